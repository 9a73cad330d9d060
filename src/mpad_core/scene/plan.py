"""The plan of a scene in words: parts, effects with their reasons, the dimensionless groups behind them, warnings."""

from collections.abc import Iterator

from mpad_core.physics.asking import blamed
from mpad_core.plugins.registry import find
from mpad_core.scene.compose import compose
from mpad_core.scene.groups import dimensionless_groups
from mpad_core.scene.provenance import lines
from mpad_core.scene.spec import Part, Scene
from mpad_core.scene.warnings import warnings_of
from mpad_core.units import thermal_energy


def plan_lines(scene: Scene) -> Iterator[str]:
    """Yield the lines of ``mpad check``.

    Raises
    ------
    InputError, PartError
        As `mpad_core.scene.compose.compose`.
    """
    problem = compose(scene)
    yield f"scene: {scene.title or '(no title)'}"
    yield f"  {len(problem.names)} cells, seed {scene.seed}, at most {scene.stop.time:g} s"
    yield "parts:"
    yield f"  solver {_named(scene.solver)}"
    for name, bond in scene.bonds.items():
        yield f"  bond {name}: {_named(bond.model)}, reach {bond.reach}, compression {bond.compression}"
    for name, site in (scene.wall.sites if scene.wall else {}).items():
        yield f"  wall sites {name}: {_named(site)}"
    if scene.repulsion:
        yield f"  repulsion: {_named(scene.repulsion)}"
    yield "effects:"
    for effect in problem.effects:
        yield f"  {effect.name:<12} {'on ' if effect.on else 'off'}  {effect.why}"
    yield "provenance:"
    yield from lines(scene)
    yield "groups:"
    kT = thermal_energy(scene.fluid.temperature)
    with blamed(f"a bond model ({', '.join(s.model.name for s in problem.species)})"):
        groups = dimensionless_groups(problem, scene.fluid.density, kT, scene.stop.time)
    for group in groups:
        yield f"  {group.name:<12} {group.value:<10.3g}{group.meaning}"
    yield "warnings:"
    yield from [f"  {found.effect:<12} {found.text}" for found in warnings_of(scene, problem)] or ["  none"]


def _named(part: Part) -> str:
    found = find(part.kind, part.name)
    given = ", ".join(f"{key} = {value!r}" for key, value in part.parameters.items())
    return f"{part.name} ({found.distribution} {found.version}){': ' + given if given else ''}"
