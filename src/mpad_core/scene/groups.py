"""The dimensionless groups that tell which effects matter in a scene; plain numpy, estimates to a few per cent."""

import math

import numpy as np
from attrs import frozen

from mpad_core.physics.problem import BondSpecies, Problem

SLIDING = 0.67  # speed of a cell near the wall over that of the fluid at its centre
HELD_FORCE, HELD_TORQUE = 1.7005, 0.944  # force and torque in shear on a held sphere touching the wall (O'Neill 1968)


@frozen(kw_only=True)
class Group:
    """One dimensionless number, what it compares, and its value."""

    name: str
    meaning: str
    value: float


def squeeze(gap: float, radius: float) -> float:
    """Give the drag normal to the wall over Stokes', within 1 % (Bevan & Prieve, J Chem Phys 113:1228, 2000)."""
    return (6 * gap**2 + 9 * gap * radius + 2 * radius**2) / (6 * gap**2 + 2 * gap * radius)


def passage_time(problem: Problem, longest: float) -> float:
    """Give the time (s) in which the flow carries a cell past all others, at most the run's."""
    span = float(np.ptp(problem.start[:, 0])) + 20 * float(problem.radii.max())
    shear = abs(problem.setting.shear_rate)
    speed = SLIDING * shear * float(problem.radii.max())
    return min(longest, span / speed) if speed > 0 else longest


def dimensionless_groups(problem: Problem, fluid_density: float, kT: float, longest: float) -> list[Group]:
    """Work the groups out for the cell that starts lowest.

    Parameters
    ----------
    problem
        What the scene asks for.
    fluid_density
        pN s²/µm⁴.
    kT
        pN µm.
    longest
        s, the run's length.
    """
    low = int(np.argmin(problem.start[:, 2] - problem.radii))
    radius, gap = float(problem.radii[low]), float(problem.start[low, 2] - problem.radii[low])
    shear, viscosity = abs(problem.setting.shear_rate), problem.setting.viscosity
    passage = passage_time(problem, longest)
    drag = 6 * math.pi * viscosity * radius * (squeeze(max(gap, 1e-6 * radius), radius) if problem.setting.wall else 1)
    weight = abs(float(problem.external[low, 2]))
    reynolds = fluid_density * shear * radius**2 / viscosity
    groups = [Group(name="Re", meaning="inertia by viscosity, rho gamma a^2 / mu", value=reynolds)]
    if problem.species:
        groups += _of_passage(problem.species[0], weight / drag * passage, math.sqrt(2 * kT * passage / drag))
        groups += _of_bond(problem.species[0], radius, viscosity * shear, drag * shear)
    return groups


def _of_passage(species: BondSpecies, settled: float, spread: float) -> list[Group]:
    """Compare what settles and what spreads (µm) in a passage with the bond's length."""
    length = species.rest_length
    return [
        Group(name="settling", meaning="settling in a passage, by the bond's length", value=settled / length),
        Group(
            name="spread",
            meaning="thermal spread in height in a passage, by the bond's length",
            value=spread / length,
        ),
    ]


def _of_bond(species: BondSpecies, radius: float, stress: float, pull: float) -> list[Group]:
    """Compare a bond with the flow: `stress` is μγ (pN/µm²), `pull` the cell's drag times the shear rate (pN/µm)."""
    length = species.rest_length
    stiffness = float(np.diff(species.model.tension(np.array([1.01, 1.02]) * length))[0] / (0.01 * length))
    stiffness = max(stiffness, 1e-300)
    force = HELD_FORCE * 6 * math.pi * stress * radius**2
    torque = HELD_TORQUE * 4 * math.pi * stress * radius**3
    tether = math.sqrt(radius / (2 * length)) * (force + torque / radius)
    lengths = np.array([length, length + tether / stiffness])
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        rates = np.reshape(species.model.off_rate(lengths), (-1, 2))[0]  # of inner states, the first
        speeding = float(np.log(rates[1] / rates[0]))
    return [
        Group(
            name="F r0/kT",
            meaning="log of how much the load of a held cell on one tether speeds its breaking",
            value=speeding,
        ),
        Group(
            name="relaxation",
            meaning="relaxation of one bond against the drag, by the shear time",
            value=pull / stiffness,
        ),
    ]
