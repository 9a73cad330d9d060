"""Hypothesis strategies: configurations of spheres, loads, lengths."""

import os
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from mpad_core.arrays import Array
from mpad_core.interfaces.values import Configuration

F = TypeVar("F", bound=Callable[..., Any])

_CELL = 5.0  # side of the lattice that keeps spheres of radius 2 at most apart
_JITTER = 0.4
_STEEP = 0.6  # of a chain's steps: with radii to 2:1 the next but one keeps a tenth of a radius away
_MORE = float(os.environ.get("MPAD_EXAMPLES", "1"))  # times the number of examples of every law


def tried(number: int, shrink: bool = True) -> Callable[[F], F]:
    """Try a law on so many examples, the same ones every time; contracts are inherited, hence run by many classes.

    The environment's ``MPAD_EXAMPLES`` multiplies the number. An example that fails is shrunk to the smallest that
    does, unless that would cost more than it tells.
    """
    decorate: Callable[[F], F] = settings(
        max_examples=max(1, round(number * _MORE)),
        deadline=None,
        derandomize=True,
        phases=[phase for phase in Phase if shrink or phase not in (Phase.shrink, Phase.explain)],
        database=None,
        suppress_health_check=[HealthCheck.differing_executors, HealthCheck.too_slow],
    )
    return decorate


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw finite floats from a range."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False, allow_subnormal=False)


@st.composite
def configurations(
    draw: st.DrawFn, *, fewest: int = 1, most: int = 4, unequal: bool = True, smallest_gap: float = 1e-3
) -> Configuration:
    """Draw spheres of radius 0.5 to 2 that touch neither each other nor the wall z = 0, the lowest ones near it.

    Parameters
    ----------
    fewest, most
        Number of spheres.
    unequal
        Whether radii may differ.
    smallest_gap
        Smallest gap to the wall, in radii.
    """
    count = draw(st.integers(fewest, most))
    side = int(np.ceil(most ** (1 / 3) - 1e-9))
    places = draw(st.permutations(range(side**3)))[:count]
    radii = np.array([draw(numbers(0.5, 2.0)) for _ in range(count if unequal else 1)] * (1 if unequal else count))
    centres = np.empty((count, 3))
    for i, place in enumerate(places):
        cell = np.array([place % side, place // side % side, place // side**2])
        centres[i] = _CELL * cell + [draw(numbers(-_JITTER, _JITTER)) for _ in range(3)]
        gap = smallest_gap * (5.0 / smallest_gap) ** draw(numbers(0.0, 1.0))
        if cell[2] == 0:
            centres[i, 2] = radii[i] * (1 + min(gap, 0.2))
        else:
            centres[i, 2] += 2.5 + _JITTER
    return Configuration(centres=centres, radii=radii)


def chain(radii: Array, gaps: Array, directions: Array, rises: Array) -> Configuration:
    """Place spheres in a chain above the wall.

    Parameters
    ----------
    radii, gaps : (N,)
        And the gap of each to the one before, of the first to the wall, over the smaller radius.
    directions : (N,)
        Of each from the one before, radians from x; -0.5 to 0.5: no chain comes back to itself.
    rises : (N,)
        0: from the one before as steeply down as chains and the wall allow, 1: up.
    """
    centres = np.array([[0.0, 0.0, radii[0] * (1 + gaps[0])]])
    for i in range(1, len(radii)):
        reach = radii[i - 1] + radii[i] + min(radii[i - 1], radii[i]) * gaps[i]
        lowest = max(radii[i] * (1 + gaps.min()) - centres[-1, 2], -_STEEP * reach)
        rise = lowest + (_STEEP * reach - lowest) * rises[i]
        across = np.sqrt(reach**2 - rise**2)
        step = [across * np.cos(directions[i]), across * np.sin(directions[i]), rise]
        centres = np.vstack([centres, centres[-1] + step])
    return Configuration(centres=centres, radii=radii)


@st.composite
def chains(draw: st.DrawFn, fewest: int = 2, most: int = 4, smallest_gap: float = 0.05) -> Configuration:
    """Draw spheres in a chain, gaps of neighbours and to the wall from the smallest to three radii."""
    count, shares = draw(st.integers(fewest, most)), st.tuples(*[numbers(0.0, 1.0)] * 4)
    drawn = np.array([draw(shares) for _ in range(count)])
    return chain_of(drawn, smallest_gap)


def chain_of(shares: Array, smallest_gap: float) -> Configuration:
    """Place a chain by four numbers in (0, 1) for each sphere (N, 4)."""
    radii, gaps = 0.7 * 2.0 ** shares[:, 0], smallest_gap * (3.0 / smallest_gap) ** shares[:, 1]
    return chain(radii, gaps, shares[:, 2] - 0.5, shares[:, 3])


def some_chains(number: int, smallest_gap: float = 0.05) -> list[Configuration]:
    """Give a fixed sample of chains of two to four spheres."""
    draws = np.random.Generator(np.random.Philox(3))
    return [chain_of(draws.uniform(size=(2 + i % 3, 4)), smallest_gap) for i in range(number)]


def crowd(count: int, unequal: bool = True) -> Configuration:
    """Give one fixed configuration of many spheres on a jittered lattice above the wall."""
    draws = np.random.Generator(np.random.Philox(7))
    side = int(np.ceil(count ** (1 / 3)))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    radii = draws.uniform(0.5, 2.0, count) if unequal else np.full(count, 1.3)
    centres = _CELL * lattice + draws.uniform(-_JITTER, _JITTER, (count, 3))
    centres[:, 2] += 2.5
    return Configuration(centres=centres, radii=radii)


def some_loads(shape: tuple[int, ...], seed: int = 0) -> Array:
    """Give fixed standard normal loads."""
    return np.random.Generator(np.random.Philox(seed)).normal(size=shape)
