"""The reference: the finest level that answers, and how far it may itself be from the truth.

That is told by a still finer setting of the same solver, where its parameters allow one; else the next coarser level
tells it, which is more than it can be.
"""

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from attrs import frozen

from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.physics.levels import Level, Situation
from mpad_core.physics.problem import Problem
from mpad_core.studies.cost.solving import Answers, answers, errors

_TIGHTER = 1e-3  # by which a solver's tolerance, if it has one, is multiplied besides
_SHARES = (1.0, 0.5, 0.25)  # of the last step between levels, on a logarithmic scale, that are tried


@frozen(kw_only=True)
class Doubt:
    """By how much the reference may be wrong, and what tells."""

    size: float  # relative, median over the situations
    against: str  # what it was compared with


def doubt_by_finer(level: Level, found: Answers, problem: Problem, situations: Sequence[Situation]) -> Doubt | None:
    """Tell how far a level's answers are from those of a finer setting; None where its solver has none."""
    for finer, label in finer_than(level):
        try:
            beyond = answers(finer, problem, situations)
        except MpadError:
            continue
        return Doubt(size=_median_error(found, beyond, problem), against=label)
    return None


def doubt(levels: Sequence[Level], found: Sequence[Answers], problem: Problem) -> Doubt:
    """Tell how far the last of some levels is from the one before.

    Parameters
    ----------
    levels, found
        Those that answered, the finest last, and what they answered.
    """
    if len(levels) == 1:
        return Doubt(size=np.inf, against="nothing, as it is alone")
    return Doubt(size=_median_error(found[-2], found[-1], problem), against=levels[-2].label)


def _median_error(one: Answers, other: Answers, problem: Problem) -> float:
    return float(np.median(errors(one, other, problem.radii).whole))


def finer_than(level: Level) -> list[tuple[MobilitySolver, str]]:
    """Give settings of a level's solver that are finer still, the finest first, with what they are called.

    What varies from its next coarser level to this one goes on by the same factor, or as far as the solver allows.
    """
    made, coarser = type(level.solver), _next_coarser(level)
    factors = {
        key: value / coarser[key]
        for key, value in level.parameters
        if isinstance(value, float) and isinstance(coarser.get(key), float) and coarser[key] > 0
    }
    tolerance = {"tolerance": level.solver.tolerance * _TIGHTER} if hasattr(level.solver, "tolerance") else {}
    found = []
    for share in _SHARES if factors or tolerance else ():
        steps = {key: getattr(level.solver, key) * factor**share for key, factor in factors.items()}
        try:
            finer = attrs.evolve(level.solver, **(steps | tolerance))  # type: ignore[misc]  # parts are attrs classes
        except (ValueError, TypeError):
            continue
        said = ", ".join(f"{key}={value:.2g}" for key, value in (steps | tolerance).items())
        found.append((finer, f"{made.name} {said}"))
    return found


def _next_coarser(level: Level) -> dict[str, Any]:
    """Give the parameters of the solver's level that claims the next larger error."""
    claims = sorted(level.solver.traits.levels, key=lambda one: one.error)
    larger = [one for one in claims if one.error > level.claim]
    return dict(larger[0].parameters) if larger else {}
