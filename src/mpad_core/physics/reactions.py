"""Bond laws: a bond model with compression and detailed balance added, as functions of the bond's length.

The on-rate follows from the off-rate and the elastic energy E (King & Hammer, PNAS 2001: "a Boltzmann distribution for
the binding affinity"):  k_on(x) = k_on(λ) · k_off(x) / k_off(λ) · exp(−E(x) / kT), so k_on / k_off = K exp(−E / kT) at
every length, whatever the model. Slack bonds have no tension and no energy below the unstressed length λ; linear ones
push there.

A bond with inner states s = 0 … S − 1, exchange rates X_st(x) between them and an off-rate of each may also form in
each. At a fixed length the free pair and the S bound states are a chain with S ways of binding. It is in detailed
balance if there are equilibrium shares P with P_free on_s = P_s off_s and P_s X_st = P_t X_ts for all s and t. The
second set gives P_s = w_s P_0 with w_s = X_0s / X_s0 (along a way from state to state where X_0s is zero), the first
one then on_s / off_s = w_s P_0 / P_free, and P_0 / P_free = K exp(−E / kT) as for a bond without inner states: E is the
energy of state 0, and −kT ln w_s what state s lies above it. K is fixed by what the scene says, Σ_s on_s(λ) = k_on. So

    on_s(x) = k_on · off_s(x) w_s(x) exp(−E(x) / kT) / Σ_t off_t(λ) w_t(λ).

With one state this is the line above.
"""

from itertools import pairwise

import numpy as np
from attrs import evolve, frozen
from numpy.polynomial.legendre import leggauss

from mpad_core.arrays import Array
from mpad_core.interfaces.bonds import Encounter, Interconverting
from mpad_core.interfaces.errors import PartError
from mpad_core.numerics.tables import Function, Tables, tabulate
from mpad_core.physics import inner_states
from mpad_core.physics.asking import blamed
from mpad_core.physics.problem import BondSpecies

TABLE_ERROR = 1e-6
ENCOUNTER_ERROR = 1e-5  # relative, of the table of an encounter
SLOWEST, FASTEST = 1e-6, 1e5  # µm/s: a nanometre in a quarter of an hour; a hundred times a fast cell
NEVER = 1e-12  # 1/s, once in 30 000 years: rates that have fallen below are tabulated as none
_NEGLIGIBLE = 1e-9  # of the unstressed on-rate: beyond, no bond forms
_FALLEN = 1e-3  # of its largest value: an on-rate that has fallen so far at ten rest lengths has a reach of its own
_INSTANT = 1e8  # 1/s: a bond that breaks faster does not live through any sub-step
_OVERFLOW = 1e200  # 1/s: a state's table ends where the others' off-rates, asked for with its own, come near infinity
_STRONG = 1e6  # pN: no bond of any cell comes near
_MODEST = 1e3  # pN: any model must give a rate at such a tension
_FARTHEST = 30.0  # rest lengths; tables end here at the latest, and go on by their tangent
_STEPS = np.concatenate([[0.0], np.geomspace(1e-4, _FARTHEST, 2000)])  # of the rest length, away from it
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

    def states(self) -> int:
        """Give the number of inner states; one for a model that has none."""
        model = self.species.model
        return int(model.states()) if isinstance(model, Interconverting) else 1

    def _who(self) -> str:
        return f"bond model {self.species.model.name!r} of bond {self.species.name!r}"

    def _asked(self, member: str, length: Array, *axes: int) -> Array:
        """Ask the model for rates, with leading axes that a model without inner states may leave out."""
        rates = np.asarray(getattr(self.species.model, member)(self._felt(length)), float)
        if self.states() > 1 and rates.shape != (*axes, *np.shape(length)):
            wanted = (*axes, *np.shape(length))
            raise PartError(f"{self._who()}: {member}() gives shape {rates.shape} with inner states, not {wanted}")
        return np.broadcast_to(rates, (*axes, *np.shape(length)))

    def off_rates(self, length: Array) -> Array:
        """Give the rates of breaking (1/s) from each inner state, (S, ...)."""
        return self._asked("off_rate", length, self.states())

    def off_rate(self, length: Array, state: int = 0) -> Array:
        """Give the rate of breaking (1/s) from an inner state."""
        rate: Array = self.off_rates(length)[state]
        return rate

    def exchange(self, length: Array) -> Array:
        """Give the rates (1/s) between inner states, (S, S, ...), row = from, column = to."""
        if self.states() == 1:
            return np.zeros((1, 1, *np.shape(length)))
        rates = self._asked("exchange", length, self.states(), self.states())
        if np.einsum("ss...->s...", rates).any():
            raise PartError(f"{self._who()}: exchange() has a diagonal that is not zero")
        return rates

    def _log_weights(self, length: Array) -> Array:
        """Give ln w_s (S, ...), how the exchange weighs the states against state 0."""
        if self.states() == 1:
            return np.zeros((1, *np.shape(length)))
        at_rest = self.exchange(np.array([self.species.rest_length]))[..., 0]
        exchange = self.exchange(length)
        weights = inner_states.log_weights(exchange, inner_states.links(at_rest, self._who()))
        inner_states.check_balance(exchange, weights, self._who())
        return weights

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

    def on_rates(self, length: Array) -> Array:
        """Give the rates of formation (1/s) into each inner state, (S, ...), at the wall's reference density.

        Without regard to reach.

        Raises
        ------
        PartError
            If the exchange between inner states keeps no detailed balance, or leaves out a state.
        """
        if hasattr(self.species.model, "on_rate"):
            return self._asked("on_rate", length, self.states())
        rest = np.array([self.species.rest_length])
        off, at_rest = self.off_rates(length), float((self.off_rates(rest) * np.exp(self._log_weights(rest))).sum())
        if not at_rest > 0:  # never breaks: as if all states did so at one rate
            off, at_rest = np.ones_like(off), float(np.exp(self._log_weights(rest)).sum())
        boltzmann = np.exp(self._log_weights(length) - self.energy(length) / self.species.kT)
        balanced: Array = self.species.on_rate * (off / at_rest) * boltzmann
        return balanced

    def on_rate(self, length: Array) -> Array:
        """Give the rate of formation (1/s) into any inner state, as `on_rates`."""
        rate: Array = self.on_rates(length).sum(axis=0)
        return rate

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

    def _bounded(self, lengths: Array, state: int) -> float:
        """Give the last of the lengths, walking away from rest, at which the bond in a state is of any consequence."""
        with np.errstate(over="ignore", invalid="ignore"):
            rates, tensions = self.off_rates(lengths), np.abs(self.tension(lengths))
            leaving = rates[state] + self.exchange(lengths)[state].sum(axis=0)
        if (np.isnan(leaving) & (tensions < _MODEST)).any():  # far beyond, 0 · exp(…) may overflow to one
            raise PartError(f"bond model {self.species.model.name!r} gives an off-rate that is not a number")
        tame = (leaving < _INSTANT) & (tensions < _STRONG) & (rates < _OVERFLOW).all(axis=0)
        return float(lengths[-1] if tame.all() else lengths[max(int(np.argmin(tame)) - 1, 1)])

    def _lasting(self, rate: Function) -> tuple[float, float]:
        """Give the lengths (µm) beyond which a rate has fallen to nothing, on either side; infinite where it never has.

        The exponential of a catch bond falls through all numbers that a computer has; no table follows it there.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            longer = np.flatnonzero(np.abs(rate(self.species.rest_length * (1 + _STEPS))) >= NEVER)
            shorter = np.flatnonzero(np.abs(rate(self.species.rest_length * np.maximum(1 - _STEPS, 0))) >= NEVER)
        first, last = (int(found[-1]) + 1 if len(found) else 0 for found in (shorter, longer))
        low = self.species.rest_length * (1 - _STEPS[first]) if first < len(_STEPS) else -np.inf
        high = self.species.rest_length * (1 + _STEPS[last]) if last < len(_STEPS) else np.inf
        return low, high

    def _rates(self, state: int, exchange_columns: int) -> list[tuple[Function, float, float]]:
        """Give each tabulated rate of an inner state, with the lengths between which it is more than nothing."""
        rates = [lambda x: self.off_rate(x, state)]
        rates += [lambda x, to=to: self.exchange(x)[state, to] for to in range(self.states())][:exchange_columns]
        off, *exchange = [(rate, *self._lasting(rate)) for rate in rates]
        return [off, (lambda x: self.on_rates(x)[state], *self.binding_lengths()), *exchange]

    def edges(self, state: int = 0) -> list[float]:
        """Give the ends and the breakpoints of the tables of an inner state."""
        rest = self.species.rest_length
        nearest, reach = self.binding_lengths()
        top = max(self._bounded(rest * (1 + _STEPS), state), reach * (1 + 1e-9), rest * (1 + 1e-3))
        bottom = 0.0
        if self.species.compression == "linear":
            bottom = min(self._bounded(np.maximum(rest * (1 - _STEPS), 0.0), state), nearest * (1 - 1e-9))
        inner = {rest, *self.species.model.breakpoints()}
        inner |= {float(end) for _, *ends in self._rates(state, self.states()) for end in ends}
        return [bottom, *sorted(b for b in inner if bottom < b < top), top]

    def tables(self, exchange_columns: int = 0) -> list[Tables]:
        """Tabulate the law for each inner state, good to `TABLE_ERROR`.

        Parameters
        ----------
        exchange_columns
            The least number of columns for exchange, those of states that this model does not have being zero.

        Returns
        -------
        For each inner state a table with columns tension (pN), off-rate (1/s), on-rate into the state (1/s, zero beyond
        reach), and for a model with inner states, or where asked for, the exchange rates (1/s) to states 0, 1, …

        Raises
        ------
        PartError
            If a table cannot follow the model, a rate is negative, or inner states keep no detailed balance.
        """
        columns = max(exchange_columns, self.states() if self.states() > 1 else 0)
        with blamed(self._who()):
            return [self._tabulated(state, columns) for state in range(self.states())]

    def _tabulated(self, state: int, exchange_columns: int) -> Tables:
        columns = [self.tension, *(_cut(*rate) for rate in self._rates(state, exchange_columns))]
        tables = tabulate(columns, self.edges(state), error=TABLE_ERROR, tangents=[0])
        if (tables.coefficients[:, 1:, 0] < 0).any():
            raise PartError(f"{self._who()} has a negative rate")
        lacking = 3 + exchange_columns - len(columns)
        return tables._replace(coefficients=np.pad(tables.coefficients, ((0, 0), (0, lacking), (0, 0))))


def _cut(rate: Function, low: float, high: float) -> Function:
    """Make a rate nothing outside the lengths between which it is more."""
    return lambda x: np.where((x >= low) & (x <= high), rate(np.clip(x, low, high)), 0.0)


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


def encounter_table(encounter: Encounter) -> Tables:
    """Tabulate the factor on the on-rate over the slip speed (µm/s): one column, good to `ENCOUNTER_ERROR`.

    Pieces are decades of speed. Outside `SLOWEST` and `FASTEST` the factor is that at these speeds, also at rest, where
    that of `mpad_core.physics.encounter.ChangHammer` is zero, which no surface is still for long enough to come near.

    Raises
    ------
    PartError
        If the factor is negative, not finite, not elementwise, or has kinks that no table follows.
    """
    decades = round(np.log10(FASTEST / SLOWEST))
    edges = np.geomspace(SLOWEST, FASTEST, decades + 1)
    with blamed("the encounter of a bond"):
        tables = tabulate([encounter.factor], [float(edge) for edge in edges], error=ENCOUNTER_ERROR, tangents=[])
    if (tables.coefficients[..., 0] < 0).any():
        raise PartError("the encounter of a bond has a negative factor on the on-rate")
    return tables
