"""Parts in a scene: their parameters are read by the part's own fields, strictly."""

from typing import Any, ClassVar

import pytest
from attrs import Factory, field, frozen

from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.scene.files import parse_scene, resolved_toml
from mpad_core.scene.spec import Part

Parts = dict[tuple[str, str], Any]


def repulsion(small: str, said: str) -> Part:
    found = parse_scene(f"repulsion = {said}\n{small}", "s.toml").repulsion
    assert found is not None
    return found


def refused(text: str) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml")
    return caught.value.lines


def test_a_part_by_name_alone_has_its_defaults(fake_parts: Parts, small: str) -> None:
    part = parse_scene(small.replace('"isolated"', '"rpb"')).solver
    assert part == Part(kind="solver", name="rpb", parameters={"lone_sphere": "exact", "order": 3, "tolerance": 1e-6})
    assert part.instance == fake_parts["solver", "rpb"]()


def test_the_law_of_repulsion_has_a_default(fake_parts: Parts, small: str) -> None:
    part = repulsion(small, "{ strength = '0.5 nN um', decay = '1 1/nm' }")
    assert (part.kind, part.name) == ("force", "electrostatic")
    assert part.instance == fake_parts["force", "electrostatic"](strength=500, decay=1000)


def test_parameters_without_a_unit_take_any_dimension_or_none(fake_parts: Parts, small: str) -> None:
    part = repulsion(
        small, "{ law = 'spring', stiffness = '2 pN/nm', inner = 3, box = ['1 nm', 2, 3.5], gentle = true }"
    )
    assert part.instance == fake_parts["force", "spring"](stiffness=2000, inner=3, box=(0.001, 2, 3.5), gentle=True)
    assert part.written == {"stiffness": "2 pN/nm"}


def test_parts_without_units_are_written_and_read_the_same(fake_parts: Parts, small: str) -> None:
    text = "repulsion = { law = 'spring', stiffness = '2.1 kT_unknown' }\n" + small
    scene = parse_scene(text.replace("2.1 kT_unknown", "2.1 pN/nm"))
    again = parse_scene(resolved_toml(scene))
    assert again == scene
    assert again.repulsion is not None
    assert again.repulsion.instance == fake_parts["force", "spring"](stiffness=2100)


def test_observers_are_a_list_of_parts(fake_parts: Parts, small: str) -> None:
    scene = parse_scene(small + "[record]\nobservers = ['watcher', { name = 'watcher', label = 'v' }]")
    assert [part.instance.label for part in scene.record.observers] == ["w", "v"]
    assert parse_scene(resolved_toml(scene)) == scene


def test_bond_models_are_filled_by_the_core(fake_parts: Parts, examples: dict[str, str]) -> None:
    model = parse_scene(examples["capture"]).bonds["tether"].model
    bell = model.build(rest_length=0.03, stiffness=1e5, kT=4e-3, unasked=1)
    assert (bell.rest_length, bell.stiffness, bell.kT, bell.off_rate) == (0.03, 1e5, 4e-3, 2)


def test_what_the_scene_gives_goes_before_what_the_core_fills(fake_parts: Parts, examples: dict[str, str]) -> None:
    text = examples["capture"].replace('name = "bell",', 'name = "bell", stiffness = "7 pN/um",')
    model = parse_scene(text).bonds["tether"].model
    assert model.build(rest_length=0.03, stiffness=1e5, kT=4e-3).stiffness == 7


def test_a_bond_models_validators_speak_at_its_line(fake_parts: Parts, examples: dict[str, str]) -> None:
    text = examples["capture"].replace("0.4 angstrom", "40 nm")
    line = next(number for number, said in enumerate(text.split("\n"), 1) if said.startswith("model"))
    assert refused(text) == (
        f"s.toml:{line}: bonds.tether.model: 'bell' refuses: reactive_compliance must be shorter than the bond",
    )


SPRINGS = [
    ("{ law = 'sprng' }", "repulsion.law: no force 'sprng' is installed; did you mean 'spring'?"),
    ("{ law = 3 }", "repulsion.law: must be text in quotes, not 3; name a force (installed: electrostatic, spring)"),
    ("3", "repulsion: must be the name of a force, or a table with law, not 3"),
    ("'spring'", "repulsion.stiffness: missing parameter of 'spring'"),
    ("'electrostatic'", "repulsion.strength: missing parameter of 'electrostatic'; write strength = \"2 pN um\""),
    (
        "{ law = 'spring', stifness = 2 }",
        "repulsion.stifness: unknown parameter of 'spring'; did you mean 'stiffness'?",
    ),
    ("{ law = 'spring', stiffness = true }", "repulsion.stiffness: must be a number without units, not true"),
    ("{ law = 'spring', stiffness = inf }", "repulsion.stiffness: must be a finite number, not inf"),
    ("{ law = 'spring', stiffness = '3 A' }", "repulsion.stiffness: '3 A' has a dimension unknown here: [current]"),
    ("{ law = 'spring', stiffness = '3 km^99' }", "repulsion.stiffness: "),
    ("{ law = 'spring', stiffness = 1, number = 2.0 }", "repulsion.number: must be a whole number, not 2.0"),
    ("{ law = 'spring', stiffness = 1, number = '2' }", "repulsion.number: must be a whole number, not '2'"),
    ("{ law = 'spring', stiffness = 1, gentle = 1 }", "repulsion.gentle: must be true or false, not 1"),
    ("{ law = 'spring', stiffness = 1, reach = 0 }", "repulsion.reach: 'spring' refuses: 'reach' must be > 0: 0.0"),
    ("{ law = 'spring', stiffness = 1, box = [1, 'x'] }", "repulsion.box[1]: 'x' is not a number, a space and units"),
    (
        "{ strength = 3, decay = '1 1/nm' }",
        'repulsion.strength: must be a quantity with units, such as "2 pN um", not 3',
    ),
]


@pytest.mark.parametrize(("said", "line"), SPRINGS)
def test_faults_of_parts(said: str, line: str, fake_parts: Parts, small: str) -> None:
    lines = refused(f"repulsion = {said}\n{small}")
    assert any(found.startswith(f"s.toml:1: {line}") for found in lines), lines


def test_a_solver_needs_its_name(fake_parts: Parts, small: str) -> None:
    assert refused(small.replace('"isolated"', "{ order = 2 }")) == (
        "s.toml:1: solver.name: missing; name a solver (installed: rpb, isolated)",
    )


@frozen(kw_only=True)
class Odd:
    """Takes what only its own converter understands."""

    name: ClassVar[str] = "odd"
    anything: object = None
    points: Any = field(factory=list, converter=tuple)
    doubled: float = field(default=Factory(lambda self: 2.0, takes_self=True))
    several: tuple[int, ...] = field(factory=tuple)


@frozen
class Broken:
    name: ClassVar[str] = "broken"

    def __attrs_post_init__(self) -> None:
        raise RuntimeError("no table")


def test_types_unknown_here_are_left_to_the_part(fake_parts: Parts, small: str) -> None:
    fake_parts["solver", "odd"] = Odd
    scene = parse_scene(small.replace('"isolated"', '{ name = "odd", points = [[1, 2], [3, 4]], anything = "x" }'))
    assert scene.solver.instance.points == ([1, 2], [3, 4])
    assert scene.solver.parameters["several"] == ()
    assert parse_scene(resolved_toml(scene)) == scene


def test_a_part_that_fails_is_named_and_is_no_fault_of_the_scene(fake_parts: Parts, small: str) -> None:
    fake_parts["solver", "broken"] = Broken
    with pytest.raises(PartError, match="solver 'broken' cannot be made: RuntimeError: no table"):
        parse_scene(small.replace('"isolated"', '"broken"'))
    fake_parts["solver", "plain"] = type("Plain", (), {"name": "plain"})
    with pytest.raises(PartError, match="solver 'plain' is no attrs class"):
        parse_scene(small.replace('"isolated"', '"plain"'))
