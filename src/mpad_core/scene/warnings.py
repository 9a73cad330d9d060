"""What a scene takes into account although it cannot matter, and what it leaves out although it would.

Each rule compares an estimate with a limit. What is on must do a thousandth of what it is compared with; what is off
must do less than a tenth (of lengths) or a hundredth (of velocities). Estimates are right to a factor of two, so what
is between the two is left to whoever wrote the scene.
"""

from collections.abc import Callable, Iterator

import numpy as np
from attrs import frozen

from mpad_core.physics.asking import blamed
from mpad_core.physics.problem import Problem
from mpad_core.scene.estimates import APPROACH, Estimates
from mpad_core.scene.spec import Scene

NEGLIGIBLE = 1e-3  # of a velocity or a length: what an effect must do to be worth its time
FELT = 0.01  # of a velocity: what an effect may do and still be left out
SHARE = 0.1  # of the range of heights that matters: the same
INERTIAL = 0.1  # Reynolds or Stokes number from which inertia shows
NEAR_CONTACT = 0.5  # radii: gap between cells below which their lubrication shows
_LEAST_PULL = 9 / 16  # a/h: by so much a wall slows a cell far from it (Lorentz 1907)
_EARTH = 9.81e6  # µm/s²


@frozen(kw_only=True)
class Doubt:
    """One doubt about a scene."""

    effect: str
    text: str  # the estimate, the limit, and what to write


def _coupling_on(of: Estimates) -> str | None:
    if of.nearest is None:
        return 'on, but there is one cell; effects.coupling = "off" gives the same without a solve a step'
    if of.nearest.felt >= NEGLIGIBLE:
        return None
    return (
        f"on, but {_pair(of)} change each other's velocity by a share of {of.nearest.felt:.1g} at most, less than "
        f'{NEGLIGIBLE:g}; write effects.coupling = "off"'
    )


def _coupling_off(of: Estimates) -> str | None:
    if of.nearest is None or of.nearest.felt <= FELT:
        return None
    return (
        f"off, but on straight ways {_pair(of)} {_meet(of.nearest.gap)} and change each other's velocity by a share of "
        f"about {of.nearest.felt:.1g}, more than {FELT:g}; "
        'write solver = "sd", and leave effects.coupling out'
    )


def _lubrication_off(of: Estimates) -> str | None:
    if of.nearest is None or not of.problem.coupled:
        return None
    limit = NEAR_CONTACT * float(of.problem.radii.min())
    if of.nearest.gap >= limit:
        return None
    return (
        f"off, but on straight ways {_pair(of)} {_meet(of.nearest.gap)}, nearer than half a radius, {limit:.3g} um; "
        'write solver = "sd" or "cdl-biem"'
    )


def _thermal_off(of: Estimates) -> str | None:
    spread, (length, what) = of.spread(of.approach), of.range
    kept = of.problem.held[of.cell] or of.problem.alone_for[of.cell] > 0
    if kept or not of.problem.setting.wall or spread <= SHARE * length:
        return None
    way = f"the flow carries it over {APPROACH:g} radii" if of.approach < of.longest else "the run lasts"
    return (
        f"off, but while {way} ({of.approach:.3g} s) the height of {of.name} spreads by {1e3 * spread:.3g} nm, more "
        f'than a tenth of {what}, {1e3 * length:.3g} nm; write effects.thermal = "on"'
    )


def _thermal_on(of: Estimates) -> str | None:
    spread, (length, what) = of.spread(of.longest), of.range
    if of.problem.held[of.cell] or not of.problem.setting.wall or of.shear == 0 or spread >= NEGLIGIBLE * length:
        return None
    return (
        f"on, but in the whole run the height of {of.name} spreads by {1e3 * spread:.3g} nm, less than a thousandth of "
        f'{what}, {1e3 * length:.3g} nm; write effects.thermal = "off"'
    )


def _gravity_on(of: Estimates) -> str | None:
    length, what = of.range
    down = float(np.abs(of.settled(of.weights())).max())
    if not of.problem.setting.wall or down >= NEGLIGIBLE * length:
        return None
    return (
        f"on, but no cell settles by more than {1e3 * down:.1g} nm in the run, less than a thousandth of {what}, "
        f'{1e3 * length:.3g} nm; write effects.gravity = "off"'
    )


def _gravity_off(of: Estimates) -> str | None:
    length, what = of.range
    down = float(np.abs(of.settled(of.weights(-_EARTH)))[~of.problem.held].max(initial=0.0))
    if not of.problem.setting.wall or down <= SHARE * length:
        return None
    return (
        f"off, but with the densities given cells would settle or rise by {_length(down)} in the run at 9.81 m/s^2, "
        f"more than a tenth of {what}, {_length(length)}; write gravity.acceleration"
    )


def _repulsion_on(of: Estimates) -> str | None:
    contact, roughness = of.problem.contact, of.problem.roughness
    if contact is None:
        return None
    reach, nearest = contact.gaps()[1], float(of.reaches.min())
    between = of.nearest.gap - 2 * float(roughness.max()) if of.nearest else np.inf
    if min(nearest, between) < reach or (of.problem.species and nearest < of.bond_range):
        return None
    return (
        f"on, but no tips come nearer than {_length(min(nearest, between))}, and it ends at {_length(reach)}; "
        'write effects.repulsion = "off"'
    )


def _repulsion_off(of: Estimates) -> str | None:
    tips = of.problem.roughness + (of.scene.wall.roughness if of.scene.wall else 0.0)
    low = int(np.argmin(np.where(of.problem.held, np.inf, of.reaches - tips)))
    if of.problem.held[low] or of.reaches[low] > tips[low] or tips[low] == 0:
        return None
    return (
        f"off, but the tips of {of.problem.names[low]} and the wall may come within {_length(of.reaches[low])}, less "
        f"than the height of the bumps, {_length(tips[low])}, and nothing keeps them apart; write [repulsion]"
    )


def _bonds_on(of: Estimates) -> str | None:
    able = (of.problem.site_densities > 0).any(axis=1)
    between = [s for s in of.problem.species if s.partner_kind >= 0]
    if not able.any() or between or not of.scene.wall:
        return None
    nearest = float(of.reaches[able].min())
    if nearest <= of.bond_range:
        return None
    return (
        f"on, but no cell that binds comes nearer to the wall than {_length(nearest)} between tips, and bonds form up "
        f'to {_length(of.bond_range)}; start lower, or write effects.bonds = "off"'
    )


def _wall_on(of: Estimates) -> str | None:
    felt = _LEAST_PULL * float((of.problem.radii / np.maximum(of.problem.start[:, 2], 1e-300)).max())
    if felt >= NEGLIGIBLE:
        return None
    return f"on, but it slows no cell by more than a share of {felt:.1g}, less than {NEGLIGIBLE:g}; leave [wall] out"


def _wall_off(of: Estimates) -> str | None:
    if of.shear == 0 or (of.gaps <= 0).any():  # z = 0 is no wall then
        return None
    felt = _LEAST_PULL * float((of.problem.radii / of.problem.start[:, 2]).max())
    if felt <= SHARE:
        return None
    return (
        f"off, but a wall at z = 0, where the flow has no speed, would slow the lowest cell by a share of about "
        f"{felt:.1g}, more than {SHARE:g}; write [wall] if there is one"
    )


def _inertia(of: Estimates) -> str | None:
    radius, viscosity = float(of.problem.radii.max()), of.problem.setting.viscosity
    reynolds = of.scene.fluid.density * of.shear * radius**2 / viscosity
    heaviest = max(of.scene.kinds[kind].density for kind in of.problem.kinds)
    stokes = 2 / 9 * heaviest * of.shear * radius**2 / viscosity
    if max(reynolds, stokes) <= INERTIAL:
        return None
    most = of.shear * INERTIAL / max(reynolds, stokes)
    return (
        f"never simulated, but Reynolds number {reynolds:.2g} and Stokes number {stokes:.2g} (limit {INERTIAL:g}); "
        f'lower flow.rate below "{most:.2g} 1/s", or do not trust the run'
    )


_RULES: tuple[tuple[str, bool | None, Callable[[Estimates], str | None]], ...] = (
    ("wall", True, _wall_on), ("wall", False, _wall_off), ("gravity", True, _gravity_on),
    ("gravity", False, _gravity_off), ("repulsion", True, _repulsion_on), ("repulsion", False, _repulsion_off),
    ("bonds", True, _bonds_on), ("coupling", True, _coupling_on), ("coupling", False, _coupling_off),
    ("lubrication", False, _lubrication_off), ("thermal", True, _thermal_on), ("thermal", False, _thermal_off),
    ("inertia", None, _inertia),
)  # fmt: skip


def warnings_of(scene: Scene, problem: Problem) -> Iterator[Doubt]:
    """Yield every doubt about a scene; `problem` is what it composes to.

    Raises
    ------
    PartError
        If a bond model or a force law fails.
    """
    of, on = Estimates(scene=scene, problem=problem), {effect.name: effect.on for effect in problem.effects}
    for name, when, rule in _RULES:
        if when is None or on[name] == when:
            with blamed("a bond model or force law"), np.errstate(all="ignore"):  # of absurd numbers nothing is said
                text = rule(of)
            if text:
                yield Doubt(effect=name, text=text)


def _meet(gap: float) -> str:
    return f"come within {gap:.3g} um of each other" if gap > 0 else "touch"


def _pair(of: Estimates) -> str:
    assert of.nearest is not None
    return f"{of.nearest.names[0]} and {of.nearest.names[1]}"


def _length(value: float) -> str:
    return f"{value:.3g} um" if abs(value) >= 1 else f"{1e3 * value:.3g} nm"
