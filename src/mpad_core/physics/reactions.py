"""Bond laws: a bond model with compression and detailed balance added, as functions of the bond's length.

The on-rate follows from the off-rate and the elastic energy E (King & Hammer, PNAS 2001: "a Boltzmann distribution for
the binding affinity"):  k_on(x) = k_on(λ) · k_off(x) / k_off(λ) · exp(−E(x) / kT), so k_on / k_off = K exp(−E / kT) at
every length, whatever the model. Slack bonds have no tension and no energy below the unstressed length λ; linear ones
push there.
"""

from itertools import pairwise

import numpy as np
from attrs import evolve, frozen
from numpy.polynomial.legendre import leggauss

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import PartError
from mpad_core.numerics.tables import Tables, tabulate
from mpad_core.physics.asking import blamed
from mpad_core.physics.problem import BondSpecies

TABLE_ERROR = 1e-6
_NEGLIGIBLE = 1e-9  # of the unstressed on-rate: beyond, no bond forms
_FALLEN = 1e-3  # of its largest value: an on-rate that has fallen so far at ten rest lengths has a reach of its own
_INSTANT = 1e8  # 1/s: a bond that breaks faster does not live through any sub-step
_STRONG = 1e6  # pN: no bond of any cell comes near
_MODEST = 1e3  # pN: any model must give a rate at such a tension
_FARTHEST = 30.0  # rest lengths; tables end here at the latest, and go on by their tangent
_POINTS, _WEIGHTS = leggauss(24)


@frozen(kw_only=True)
class BondLaw:
    """The law of one species of bond, elementwise in the length (µm)."""

    species: BondSpecies

    def _felt(self, length: Array) -> Array:
        return np.maximum(length, self.species.rest_length) if self.species.compression == "slack" else length

    def tension(self, length: Array) -> Array:
        """Give the tension (pN)."""
        tension = np.asarray(self.species.model.tension(self._felt(length)), float)
        slack = (self.species.compression == "slack") & (length < self.species.rest_length)
        return np.where(slack, 0.0, tension)

    def off_rate(self, length: Array) -> Array:
        """Give the rate of breaking (1/s)."""
        return np.asarray(self.species.model.off_rate(self._felt(length)), float) + np.zeros_like(length)

    def energy(self, length: Array) -> Array:
        """Give the elastic energy (pN µm): the tension integrated from the unstressed length."""
        rest = self.species.rest_length
        inner = [b for b in self.species.model.breakpoints() if b != rest]
        total = np.zeros_like(length)
        for low, high in pairwise([0.0, *sorted({rest, *inner}), np.inf]):
            # the part of [rest, length] in this piece, with its sign
            start, end = np.clip(rest, low, high), np.clip(length, low, high)
            half = 0.5 * (end - start)
            places = start + half[..., None] * (1 + _POINTS)
            total = total + half * (self.tension(places) @ _WEIGHTS)
        return total

    def on_rate(self, length: Array) -> Array:
        """Give the rate of formation (1/s) at the wall's reference density, without regard to reach."""
        own = getattr(self.species.model, "on_rate", None)
        if own is not None:
            return np.asarray(own(self._felt(length)), float) + np.zeros_like(length)
        at_rest = float(self.off_rate(np.array([self.species.rest_length]))[0])
        ratio = self.off_rate(length) / at_rest if at_rest > 0 else 1.0
        balanced: Array = self.species.on_rate * ratio * np.exp(-self.energy(length) / self.species.kT)
        return balanced

    def binding_lengths(self) -> tuple[float, float]:
        """Give the lengths (µm) between which bonds form; beyond, the on-rate is negligible, or has not been asked.

        An on-rate that hardly falls with length says nothing about reach: the unstressed bond does.
        """
        rest = self.species.rest_length
        steps = np.concatenate([[0.0], np.geomspace(1e-6, 9.0, 4000)])
        with np.errstate(over="ignore", invalid="ignore"):
            longer = np.nan_to_num(self.on_rate(rest * (1 + steps)))
            shorter = np.nan_to_num(self.on_rate(rest * np.maximum(1 - steps, 0.0)))
        least = _NEGLIGIBLE * max(longer.max(), shorter.max())
        if not least > 0:
            return 0.0, rest
        end = len(steps) - 1
        last = min(int(np.flatnonzero(longer > least)[-1]) + 1, end)
        first = min(int(np.flatnonzero(shorter > least)[-1]) + 1, end)
        falls = longer[-1] < _FALLEN * longer.max()
        return rest * max(1 - steps[first], 0.0), rest * (1 + steps[last]) if falls else rest

    def reach(self) -> float:
        """Give the length (µm) beyond which no bond forms."""
        return self.binding_lengths()[1]

    def _bounded(self, lengths: Array) -> float:
        """Give the last of the lengths, walking away from rest, at which the bond is of any consequence."""
        with np.errstate(over="ignore", invalid="ignore"):
            rates, tensions = self.off_rate(lengths), np.abs(self.tension(lengths))
        if (np.isnan(rates) & (tensions < _MODEST)).any():  # far beyond, 0 · exp(…) may overflow to one
            raise PartError(f"bond model {self.species.model.name!r} gives an off-rate that is not a number")
        tame = (rates < _INSTANT) & (tensions < _STRONG)
        return float(lengths[-1] if tame.all() else lengths[max(int(np.argmin(tame)) - 1, 1)])

    def edges(self) -> list[float]:
        """Give the ends and the breakpoints of the tables."""
        rest = self.species.rest_length
        nearest, reach = self.binding_lengths()
        steps = np.concatenate([[0.0], np.geomspace(1e-4, _FARTHEST, 2000)])
        top = max(self._bounded(rest * (1 + steps)), reach * (1 + 1e-9), rest * (1 + 1e-3))
        bottom = 0.0
        if self.species.compression == "linear":
            bottom = self._bounded(np.maximum(rest * (1 - steps), 0.0))
        inner = {rest, nearest, reach, *self.species.model.breakpoints()}
        return [bottom, *sorted(b for b in inner if bottom < b < top), top]

    def tables(self) -> Tables:
        """Tabulate tension, off-rate and on-rate (zero beyond reach), good to `TABLE_ERROR`.

        Raises
        ------
        PartError
            If a table cannot follow the model.
        """
        with blamed(f"bond model {self.species.model.name!r} of bond {self.species.name!r}"):
            return self._tabulated()

    def _tabulated(self) -> Tables:
        nearest, reach = self.binding_lengths()

        def on_rate(length: Array) -> Array:
            within = (length >= nearest) & (length <= reach)
            return np.where(within, self.on_rate(np.clip(length, nearest, reach)), 0.0)

        tables = tabulate([self.tension, self.off_rate, on_rate], self.edges(), error=TABLE_ERROR, tangents=[0])
        if (tables.coefficients[:, 1:, 0] < 0).any():
            raise PartError(f"bond model {self.species.model.name!r} of bond {self.species.name!r} has a negative rate")
        return tables


@frozen(kw_only=True, eq=False)
class HazardTable:
    """The rate at which one site density per area of sphere forms a first bond, against the tip gap."""

    tip_gaps: Array  # µm, ascending
    integral: Array  # µm/s: on-rate (at the reference density) integrated over tip gaps above

    def rate(self, tip_gap: Array, shell: Array, sites: Array, density: Array) -> Array:
        """Give the expected rate (1/s) of a first bond.

        Of a sphere's molecules, spread evenly over its shell of radius R, n 2π R dg lie between the tip gaps g and
        g + dg (Archimedes), so the rate is n 2π R ∫ k_on(g) dg from the smallest tip gap on.

        Parameters
        ----------
        tip_gap : (N,)
            Smallest gap (µm) between molecules and the wall's tips.
        shell : (N,)
            Radius (µm) on which the molecules lie.
        sites : (N,)
            Sites per area (1/µm²) of that shell.
        density : (N,)
            The wall's site density, by the one that the on-rate is given at.
        """
        rate: Array = 2 * np.pi * shell * sites * density * np.interp(tip_gap, self.tip_gaps, self.integral)
        return rate


def hazard_table(law: BondLaw, k_on: float | None = None) -> HazardTable:
    """Integrate the on-rate of a species; `k_on` replaces its unstressed on-rate (1/s)."""
    if k_on is not None:
        law = BondLaw(species=evolve(law.species, on_rate=k_on))
    reach = law.reach()
    gaps = np.linspace(-4 * reach, reach, 20_001)
    lengths = np.maximum(gaps, law.species.rest_length if law.species.compression == "linear" else 0.0)
    if law.species.reach == "boltzmann_gap":
        lengths = np.maximum(gaps, 0.0)
    rates = law.on_rate(lengths)
    if law.species.reach == "pairs":  # every single molecule of the wall within reach has its own chance
        x = np.linspace(0.0, reach, 20_001)
        inner = np.concatenate([[0.0], np.cumsum(_mean(law.on_rate(x) * x) * np.diff(x))])
        rates = 2 * np.pi * law.species.at_density * (inner[-1] - np.interp(np.maximum(gaps, 0.0), x, inner))
    total = np.concatenate([[0.0], np.cumsum(_mean(rates) * np.diff(gaps))])
    return HazardTable(tip_gaps=gaps, integral=total[-1] - total)


def _mean(values: Array) -> Array:
    return 0.5 * (values[1:] + values[:-1])
