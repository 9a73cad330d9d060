"""Thermal motion against statistical mechanics; every statistical bound has a false-alarm rate below 1e-6.

A cell that weight draws towards the wall and a soft contact holds off is, height by height, a diffusion in one
dimension, with D(g) = kT M_zz(g) and the density p ∝ exp(−E/kT), E = W g − F₀ ln(1 − exp(−τ g)). So not only the means
are known but also how much averages over a time T scatter about them:

    var = (2/T) ∫ dg [∫_g^∞ (f − ⟨f⟩) p]² / (D p).
"""

from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy import stats

from mpad_core.numerics.wall_functions import FPERP, wall_functions_array
from mpad_core.running import pace

KT = 0.00411433402  # pN µm, at 298 K
STRENGTH, DECAY = 2 * KT, 50.0  # pN µm, 1/µm: soft, so that steps are long and the cell comes near the wall
FIVE_SIGMA = 5.3  # two-sided: 1.2e-7


def bead(lab: Any) -> Any:
    """A smooth bead of 5 µm and 0.257 pN weight: kT over the weight is 16 nm.

    Its repulsion goes on as its law says to 0.3 nm, where there is one chance in a million to meet the bead.
    """
    made = lab.problem({"a": 'height = "5.04 um"'}, excess=50.0, repulsion=True, thermal="on")
    contact = evolve(made.contact, strength=STRENGTH, decay=DECAY, continued_below=3e-4)
    return evolve(made, contact=contact, roughness=np.zeros(1), wall_roughness=0.0)


class Height:
    """The distribution of the gap, and how averages over time scatter."""

    def __init__(self, problem: Any) -> None:
        self.gap = np.geomspace(1e-5, 0.6, 40_001)
        weight = -problem.external[0, 2]
        self.energy = weight * self.gap - STRENGTH * np.log1p(-np.exp(-DECAY * self.gap))
        mobility = 1 / (6 * np.pi * 1e-3 * 5 * wall_functions_array(self.gap / 5)[:, FPERP])
        self.diffusivity = KT * mobility
        self.density = self._normed(np.exp(-(self.energy - self.energy.min()) / KT))

    def _normed(self, density: Any) -> Any:
        return density / np.trapezoid(density, self.gap)

    def without_drift(self) -> "Height":
        """The density to which motion without kT ∇·M comes: no flux in D p' + D' p + D p E'/kT − D' p."""
        other = object.__new__(Height)
        other.gap, other.density = self.gap, self._normed(self.density / self.diffusivity)
        return other

    def mean(self, values: Any) -> float:
        return float(np.trapezoid(values * self.density, self.gap))

    def deviation(self, values: Any, time: float) -> float:
        """Give the standard deviation of an average over a time."""
        flux = (values - self.mean(values)) * self.density
        pieces = 0.5 * (flux[1:] + flux[:-1]) * np.diff(self.gap)
        above = np.append(np.cumsum(pieces[::-1])[::-1], 0.0)
        return float(np.sqrt(2 / time * np.trapezoid(above**2 / (self.diffusivity * self.density), self.gap)))


def deviations(lab: Any, time: float, slower: float) -> dict[str, tuple[float, float]]:
    """Give by how many standard deviations averages are off, and those of motion without drift would be.

    The sub-step is `slower` times the one that thermal motion asks for, and a burst is ten of them.
    """
    problem = bead(lab)
    exact = Height(problem)
    chosen = min(pace._thermal_steps(problem)) * slower
    machine = lab.ready(problem, sub_step=chosen, longest=10 * chosen)
    seen = np.array([state.wall_gaps[0] for state in lab.states(machine, time)])
    seen = seen[len(seen) // 100 :]
    quartiles = np.interp([0.25, 0.5, 0.75], np.cumsum(exact.density * np.gradient(exact.gap)), exact.gap)
    asked = {"mean": lambda g: g, "square": lambda g: g**2}
    asked |= {f"below {q:.3f} um": (lambda g, q=q: (g < q).astype(float)) for q in quartiles}
    found = {}
    for name, f in asked.items():
        expected, deviation = exact.mean(f(exact.gap)), exact.deviation(f(exact.gap), 0.99 * time)
        wrong = exact.without_drift().mean(f(exact.gap))
        found[name] = ((f(seen).mean() - expected) / deviation, (wrong - expected) / deviation)
    print(found)
    return found


def test_heights_are_boltzmanns(lab: Any) -> None:
    """The mean, the mean square and the quartiles of the gap; a scheme without its drift would be seen at once."""
    for name, (found, wrong) in deviations(lab, time=3000.0, slower=1.0).items():
        assert abs(found) < FIVE_SIGMA, (name, found, wrong)
        if name == "mean":
            assert abs(wrong) > 2 * FIVE_SIGMA


@pytest.mark.long
def test_heights_are_boltzmanns_over_a_long_time(lab: Any) -> None:
    """With sub-steps half as long, over a time in which two parts in a hundred of the mean would be seen."""
    for name, (found, _) in deviations(lab, time=60_000.0, slower=0.5).items():
        assert abs(found) < FIVE_SIGMA, (name, found)


def test_free_diffusion(lab: Any) -> None:
    """Far from everything every step is one of independent normal displacements and turns of known variance."""
    problem = lab.problem({"a": 'height = "0 um"'}, wall=False, thermal="on")
    machine = lab.ready(problem, longest=0.01)
    states = lab.states(machine, 8.0)
    times = np.diff([state.time for state in states])[:, None]
    moved = np.diff([state.centres[0] for state in states], axis=0)
    turned = np.array([state.drift[0, 3:] for state in states[1:]]) * times
    linear = moved**2 / (2 * KT / (6 * np.pi * 1e-3 * 5) * times)
    angular = turned**2 / (2 * KT / (8 * np.pi * 1e-3 * 125) * times)
    for squares in (linear, angular):
        assert squares.size > 1000
        low, high = stats.chi2.ppf([2.5e-7, 1 - 2.5e-7], squares.size)
        assert low < squares.sum() < high
