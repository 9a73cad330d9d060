"""Which effects a scene calls for, and why."""

import math
from collections.abc import Callable

import attrs
from attrs import frozen

from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.values import SolverTraits
from mpad_core.physics.problem import LARGEST_GROUP, Effect
from mpad_core.scene.spec import Scene
from mpad_core.units import thermal_energy

_PECLET = 1000.0  # flow carries a cell this many times farther than heat, in the time of one radius


@frozen
class Call:
    """Whether there is anything for an effect to act on, and why.

    ``lacking``: why it cannot be had even if asked for. ``matters``: whether it does enough to be on unasked.
    """

    wanted: bool
    why: str
    lacking: str = ""
    matters: bool = True


def _shear(scene: Scene, traits: SolverTraits) -> Call:
    if scene.flow.rate == 0:
        return Call(False, "no flow", "the scene has no flow: add [flow] with a rate")
    return Call(True, f"flow at {scene.flow.rate:g} 1/s")


def _wall(scene: Scene, traits: SolverTraits) -> Call:
    if scene.wall is None:
        return Call(False, "no wall", "the scene has no wall: add [wall]")
    return Call(True, "no-slip wall at z = 0")


def _gravity(scene: Scene, traits: SolverTraits) -> Call:
    excess = max(abs(kind.density - scene.fluid.density) for kind in scene.kinds.values())
    if not any(scene.gravity.acceleration):
        return Call(False, "no acceleration", "the scene has no gravity: add [gravity] with an acceleration")
    if excess == 0:
        return Call(False, "every cell is as dense as the fluid")
    return Call(True, f"cells differ from the fluid's density by up to {100 * excess / scene.fluid.density:.3g} %")


def _repulsion(scene: Scene, traits: SolverTraits) -> Call:
    if scene.repulsion is None:
        return Call(False, "no law of repulsion", "the scene has no law: add [repulsion]")
    return Call(True, f"law {scene.repulsion.name!r} between roughness tips")


def _bonds(scene: Scene, traits: SolverTraits) -> Call:
    if not scene.bonds:
        return Call(False, "no bonds", "the scene has no bonds: add [bonds.<name>]")
    binding = [name for name, cell in (scene.cells | scene.groups).items() if cell.binds]
    if not binding:
        return Call(False, "every cell is a probe that does not bind")
    to = {name: " between cells" if scene.between_cells(bond) else "" for name, bond in scene.bonds.items()}
    return Call(True, f"{', '.join(name + more for name, more in to.items())}; {', '.join(binding)} can bind")


def _coupling(scene: Scene, traits: SolverTraits) -> Call:
    if not traits.coupling:
        why = f"solver {scene.solver.name!r} leaves it out"
        return Call(False, why, f"{why}: name one that couples cells (`mpad parts`)")
    cells = len(scene.cells) + sum(group.number for group in scene.groups.values())
    return Call(True, f"{cells} cells" if cells > 1 else "one cell, as the solver has it alone")


def _lubrication(scene: Scene, traits: SolverTraits) -> Call:
    if not traits.lubrication:
        why = f"solver {scene.solver.name!r} has no near-contact forces between cells"
        return Call(False, why, f"{why}: name one that has (`mpad parts`)")
    return Call(True, "near-contact forces between cells")


def _thermal(scene: Scene, traits: SolverTraits) -> Call:
    kinds = {cell.kind for cell in scene.cells.values()} | {group.kind for group in scene.groups.values()}
    radius = min(scene.kinds[kind].radius for kind in kinds)
    peclet = 6 * math.pi * scene.fluid.viscosity * radius**3 * abs(scene.flow.rate)
    peclet /= thermal_energy(scene.fluid.temperature)
    matters = peclet < _PECLET
    what = f"Peclet number 6 pi mu a^3 gamma / kT = {peclet:.3g} of the smallest cells"
    why = f"{what}, less than {_PECLET:g}" if matters else f"{what}; see `spread` for what is left out"
    why = "no flow to outdo it" if peclet == 0 else why
    number = len(scene.cells) + sum(group.number for group in scene.groups.values())
    if matters and traits.coupling and number > LARGEST_GROUP:
        why += f"; more than {LARGEST_GROUP} cells: those far apart move independently of each other"
    return Call(True, why, matters=matters)


_CALLS: dict[str, Callable[[Scene, SolverTraits], Call]] = {
    "shear": _shear, "wall": _wall, "gravity": _gravity, "repulsion": _repulsion, "bonds": _bonds,
    "coupling": _coupling, "lubrication": _lubrication, "thermal": _thermal,
}  # fmt: skip


def decide(scene: Scene, traits: SolverTraits) -> dict[str, Effect]:
    """Decide every effect.

    Raises
    ------
    InputError
        For effects switched on that cannot be had.
    """
    decided, faults = {}, []
    for name, switch in attrs.asdict(scene.effects).items():
        call = _CALLS[name](scene, traits)
        if switch == "on" and not call.wanted and call.lacking:
            faults.append(f'effects.{name}: "on", but {call.lacking}')
        on = call.wanted and (call.matters if switch == "auto" else switch == "on")
        why = call.why if switch == "auto" or not call.wanted else f'switched "{switch}" by the scene'
        decided[name] = Effect(name=name, on=on, why=why)
    if faults:
        raise InputError(*faults)
    return decided
