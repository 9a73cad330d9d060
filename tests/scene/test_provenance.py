"""Every physical value of a scene says where it comes from, and goes on saying so when the scene is read again."""

from typing import Any

import pytest

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.presets import Preset
from mpad_core.plugins import registry
from mpad_core.plugins.listing import part_lines
from mpad_core.scene.files import parse_scene, resolved_toml
from mpad_core.scene.plan import plan_lines

EXPLICIT = 'model = { name = "bell", off_rate = "2 1/s", reactive_compliance = "0.4 angstrom" }'
OFF_RATE, COMPLIANCE = "bonds.tether.model.off_rate", "bonds.tether.model.reactive_compliance"


def refused(text: str) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml")
    return tuple(line.partition(": ")[2] for line in caught.value.lines)


@pytest.fixture
def bare(examples: dict[str, str]) -> str:
    """An example without its table of provenance."""
    return examples["capture"].partition("[provenance]")[0]


def with_model(text: str, model: str) -> str:
    assert EXPLICIT in text
    return text.replace(EXPLICIT, f"model = {model}")


def test_each_physical_value_is_the_users_or_a_default(small: str, bare: str) -> None:
    assert parse_scene(small).provenance == {
        "fluid.viscosity": "user",
        "fluid.density": "default",
        "fluid.temperature": "default",
        "flow.rate": "default",
        "gravity.acceleration": "default",
        "kinds.bead.radius": "user",
        "kinds.bead.density": "default",
        "kinds.bead.roughness": "default",
    }
    tags = parse_scene(bare).provenance
    assert tags["wall.sites.p-selectin.density"] == tags[OFF_RATE] == tags["bonds.tether.reach"] == "user"
    assert tags["repulsion.continued_below"] == "default"
    assert not [key for key in tags if key.startswith(("cells", "record", "passage", "stop"))]


def test_what_the_scene_says_wins(examples: dict[str, str]) -> None:
    tags = parse_scene(examples["capture"]).provenance
    assert tags["repulsion.decay"].startswith("calibrated: ")
    assert tags["bonds.tether.stiffness"].startswith("recalled: ")
    assert tags["flow.rate"] == "published"
    assert tags["bonds.tether.on_rate.at_density"] == "user"


@pytest.mark.parametrize("overrides", [(), ('bonds.tether.model={ name = "bell", preset = "p-selectin-smith" }',)])
def test_resolved_scenes_keep_it(examples: dict[str, str], overrides: tuple[str, ...]) -> None:
    scene = parse_scene(examples["capture"], overrides=overrides)
    again = parse_scene(resolved_toml(scene))
    assert again == scene
    assert again.provenance["repulsion.continued_below"] == "default"
    assert resolved_toml(again) == resolved_toml(scene)


def test_dotted_keys_need_no_quotes(bare: str) -> None:
    text = bare + '[provenance]\nrepulsion.decay = "calibrated"\n[provenance.flow]\nrate = "published"\n'
    tags = parse_scene(text).provenance
    assert (tags["repulsion.decay"], tags["flow.rate"]) == ("calibrated", "published")


def test_what_is_set_from_outside_is_the_users(examples: dict[str, str]) -> None:
    tags = parse_scene(examples["capture"], overrides=['flow.rate="40 1/s"', 'repulsion.decay="700 1/um"']).provenance
    assert tags["flow.rate"] == tags["repulsion.decay"] == "user"
    resolved = resolved_toml(parse_scene(examples["capture"]))
    assert parse_scene(resolved, overrides=['fluid.temperature="310 K"']).provenance["fluid.temperature"] == "user"
    other = parse_scene(examples["capture"], overrides=['bonds.tether.model={ name = "ideal", off_rate = "1 1/s" }'])
    assert other.provenance[OFF_RATE] == "user"
    assert COMPLIANCE not in other.provenance


FAULTS = [
    (
        '"repulsion.decy" = "user"',
        "provenance.\"repulsion.decy\": the scene has no value 'repulsion.decy'; did",
    ),
    ('"cells.free.x" = "user"', "provenance.\"cells.free.x\": the scene has no value 'cells.free.x'"),
    ('"repulsion.decay" = "guessed"', 'provenance."repulsion.decay": must be text that begins with one of published,'),
    ('"repulsion.decay" = 3', 'provenance."repulsion.decay": must be text that begins with one of published,'),
]


@pytest.mark.parametrize(("said", "line"), FAULTS)
def test_faults_of_the_table(said: str, line: str, bare: str) -> None:
    lines = refused(f"{bare}[provenance]\n{said}\n")
    assert len(lines) == 1
    assert lines[0].startswith(line)


def test_it_must_be_a_table(small: str) -> None:
    assert refused(f"provenance = 3\n{small}") == ("provenance: must be a table, not 3",)


# Presets


def test_a_preset_gives_parameters_with_their_source(bare: str) -> None:
    scene = parse_scene(with_model(bare, '{ name = "bell", preset = "p-selectin-smith" }'))
    assert scene.bonds["tether"].model.parameters == {"off_rate": 2.4, "reactive_compliance": 3.9e-5}
    for key in (OFF_RATE, COMPLIANCE):
        assert scene.provenance[key].startswith("recalled: preset p-selectin-smith, Smith, Berg & Lawrence")
    assert parse_scene(resolved_toml(scene)) == scene


def test_what_stands_beside_a_preset_goes_before_it(bare: str) -> None:
    scene = parse_scene(with_model(bare, '{ name = "bell", preset = "p-selectin", off_rate = "3 1/s" }'))
    assert scene.bonds["tether"].model.parameters == {"off_rate": 3.0, "reactive_compliance": 4e-5}
    assert scene.provenance[OFF_RATE] == "user"
    assert scene.provenance[COMPLIANCE].startswith("published: preset p-selectin, King & Hammer, PNAS")


def test_the_preset_of_the_paper_is_the_examples(bare: str) -> None:
    chosen = parse_scene(with_model(bare, '{ name = "bell", preset = "p-selectin" }')).bonds["tether"].model
    assert chosen == parse_scene(bare).bonds["tether"].model


MODELS = [
    (
        '{ name = "bell", preset = "p-slectin" }',
        "bonds.tether.model.preset: 'bell' has no preset 'p-slectin'; did you mean 'p-selectin'? (it has: p-selectin, ",
    ),
    ('{ name = "bell", preset = 3 }', "bonds.tether.model.preset: 'bell' has no preset 3 (it has: p-selectin, "),
    (
        '{ name = "ideal", preset = "p-selectin", off_rate = "1 1/s" }',
        "bonds.tether.model.preset: 'ideal' has no preset 'p-selectin' (it has: none)",
    ),
]


@pytest.mark.parametrize(("model", "line"), MODELS)
def test_faults_of_presets(model: str, line: str, bare: str) -> None:
    lines = refused(with_model(bare, model))
    assert len(lines) == 1
    assert lines[0].startswith(line)


def test_a_preset_must_fit_its_part(bare: str, monkeypatch: Any) -> None:
    odd = Preset(parameters={"of_rate": 1.0}, source="nowhere", provenance="recalled")
    monkeypatch.setattr(registry.load("bond", "bell"), "presets", {"odd": odd})
    with pytest.raises(PartError, match="its preset 'odd' sets of_rate, which it does not have"):
        parse_scene(with_model(bare, '{ name = "bell", preset = "odd" }'))
    with pytest.raises(ValueError, match="provenance"):
        Preset(parameters={}, source="nowhere", provenance="guessed")  # type: ignore[arg-type]


def test_parts_and_check_show_them(examples: dict[str, str]) -> None:
    listed = list(part_lines())
    assert "      preset p-selectin  published: King & Hammer, PNAS 98:14919, 2001: P-selectin and PSGL-1" in listed
    lines = list(plan_lines(parse_scene(examples["capture"])))
    start = lines.index("provenance:")
    assert [line.split()[0] for line in lines[start + 1 : start + 6]] == [
        "published", "recalled", "calibrated", "user", "default",
    ]  # fmt: skip
    assert lines[start + 3] == "  calibrated   repulsion.decay"
