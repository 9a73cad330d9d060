"""How sites lie on cells, as a scene says it."""

from typing import Any

import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.physics.layouts.clusters import Clusters
from mpad_core.physics.layouts.microvilli import Microvilli
from mpad_core.physics.layouts.uniform import Uniform
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene, resolved_toml

TIPS = 'layout = "microvilli", tips = "5 1/um^2", tip_radius = "60 nm"'
CLUSTERS = 'layout = "clusters", cluster_size = 30, cluster_radius = "50 nm"'


def with_sites(examples: dict[str, str], said: str) -> str:
    text = examples["capture"]
    assert 'slex = { layout = "uniform"' in text
    return text.replace('slex = { layout = "uniform"', f"slex = {{ {said}")


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ('layout = "uniform"', Uniform()),
        (TIPS, Microvilli(tips=5.0, tip_radius=0.06)),
        (CLUSTERS, Clusters(cluster_size=30.0, cluster_radius=0.05)),
    ],
)
def test_a_layout_reaches_every_cell_and_is_written_and_read_the_same(
    examples: dict[str, str], said: str, expected: Any
) -> None:
    scene = parse_scene(with_sites(examples, said))
    problem = compose(scene)
    assert problem.layouts == ((expected,),) * len(problem.names)
    assert parse_scene(resolved_toml(scene)) == scene


FAULTS = [
    ('tips = "5 1/um^2"', "tips: unknown to layout 'uniform' (it takes none but density)"),
    (TIPS + ", cluster_size = 3", "cluster_size: unknown to layout 'microvilli' (its keys: tips, tip_radius)"),
    ('layout = "clusters", cluster_size = 3', "cluster_radius: missing; layout 'clusters' needs cluster_size, cluster"),
    (TIPS.replace("60 nm", "0.3 um"), "tips: its 1571 tips on each cell would cover 1.32 of it, the most is 0.45;"),
    (TIPS.replace("5 1/um^2", "1e-4 1/um^2"), "tips: makes 0 tips on each cell, which must have from 1 to 20000"),
    (CLUSTERS.replace("30", "0.5"), "cluster_size: must be at least 1 and at most 1000000, not 0.5"),
    (CLUSTERS.replace("30", '"3 um"'), "cluster_size: must be a number without units, not '3 um'"),
    ('layout = "microvili"', "layout: must be one of 'uniform', 'microvilli', 'clusters', not 'microvili'; did you"),
]


@pytest.mark.parametrize(("said", "expected"), FAULTS)
def test_what_does_not_fit_is_refused_at_its_line(examples: dict[str, str], said: str, expected: str) -> None:
    text = with_sites(examples, said)
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml")
    line = next(number for number, one in enumerate(text.split("\n"), 1) if "slex = {" in one)
    where = "kinds." + next(k for k in parse_scene(examples["capture"]).kinds) + ".sites.slex."
    assert any(found.startswith(f"s.toml:{line}: {where}{expected}") for found in caught.value.lines), caught.value
