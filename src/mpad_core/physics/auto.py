"""The solver that is a choice among those installed.

Light: what the chosen ones need is imported when they plan.
"""

from typing import Any, ClassVar

import numpy as np
from attrs import field, frozen, validators

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError, MpadError, RefusedError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.values import AccuracyLevel, Configuration, Motion, Rung, Setting, SolverTraits
from mpad_core.physics import asking
from mpad_core.physics.levels import Level, installed_levels, level_named, relative_error
from mpad_core.physics.questions import check_needs, unit_load
from mpad_core.plugins.hookspecs import hookimpl

_WORTH_TRYING = 1.6  # times less than the rung before is what the next one claims; those as near may err alike
_DOUBT = 2.0  # by which estimates that nothing has been compared with may fall short


@frozen(kw_only=True)
class Auto:
    """The cheapest installed solver that is as exact as asked for.

    A run chooses once, at its start, by trying all solvers on the scene itself, writes its choice into the resolved
    scene, and climbs to a more exact one where the error on the way no longer meets the request. Asked without a run,
    it tries the installed levels from the coarsest claim on, until one reports an error that meets the request, or
    agrees with a coarser one: under weights, and in the flow, or where there is none under loads that push spheres
    together. So one configuration is answered by one solver, whatever the loads.

    Parameters
    ----------
    accuracy
        Largest relative error of the velocities.
    levels
        What to choose from, the first to be tried first, each a solver and its level, as ``"cdl-biem accuracy=0.01"``;
        all that are installed if left out. A run fills it in.
    trust
        For each level, the true error over that reported, as measured; 1 if left out.
    reason
        Why these, in words; nobody acts on it.
    """

    name: ClassVar[str] = "auto"
    traits: ClassVar[SolverTraits] = SolverTraits(
        lubrication=True,
        levels=(AccuracyLevel(parameters=(("accuracy", 1e-2),), error=1e-2),),
    )

    accuracy: float = field(default=1e-2, validator=[validators.ge(1e-6), validators.le(0.5)])
    levels: tuple[str, ...] = ()
    trust: tuple[float, ...] = field(default=())
    reason: str = ""

    @trust.validator
    def _one_for_each_level(self, attribute: object, value: tuple[float, ...]) -> None:
        if value and (len(value) != len(self.levels) or not all(0 < trust < np.inf for trust in value)):
            raise ValueError(
                f"trust must be one positive number for each of the {len(self.levels)} levels, not {value}"
            )

    @property
    def tolerance(self) -> float:
        """Residual to which the least careful of its levels iterates."""
        return max(float(getattr(rung.solver, "tolerance", 0.0)) for rung in self.rungs())

    def rungs(self) -> tuple[Rung, ...]:
        """Give the levels to be tried, in this order.

        Raises
        ------
        InputError
            If one of `levels` is not installed.
        """
        chosen = [level_named(label) for label in self.levels] if self.levels else _worth_trying(self.accuracy)
        trusts = self.trust or (1.0,) * len(chosen)
        return tuple(
            Rung(label=level.label, solver=level.solver, claim=level.claim, trust=trust)
            for level, trust in zip(chosen, trusts, strict=True)
        )

    def plan(self, setting: Setting) -> Any:
        """Keep the setting; solvers plan when they are tried."""
        return _Plan(setting=setting, accuracy=self.accuracy, rungs=self.rungs())

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        """Try one level after the other at a configuration; keep the first that reports an error small enough.

        Raises
        ------
        RefusedError
            If all refuse, with what the last one says.
        """
        return plan.prepared(configuration)

    def solve(self, prepared: Any, loads: Array) -> Motion:
        """Give the chosen solver's answer; its guess is of no use to another, and left out."""
        motion = prepared.solver.solve(prepared.inner, loads)
        return Motion(velocity=motion.velocity, report=motion.report)


def _worth_trying(accuracy: float) -> list[Level]:
    """Thin out the installed levels, so that each claims clearly less than the one before.

    References are left out unless they alone claim what is asked for.
    """
    found: list[Level] = []
    for level in installed_levels():
        if not np.isfinite(level.claim):
            continue
        if level.reference and found and found[-1].claim <= accuracy:
            continue
        if not found or level.claim * _WORTH_TRYING <= found[-1].claim:
            found.append(level)
    return found


@frozen(kw_only=True, eq=False)
class _Prepared:
    """A configuration as the chosen solver has it."""

    solver: Any
    inner: Any


@frozen(kw_only=True, eq=False)
class _Plan:
    """What stays the same; plans of solvers are made when needed, and kept."""

    setting: Setting
    accuracy: float
    rungs: tuple[Rung, ...]
    plans: dict[str, Any] = field(factory=dict)

    def prepared(self, at: Configuration) -> _Prepared:
        loads, found = _tried_loads(self.setting, at), None
        refusal: MpadError = InputError("solver 'auto': no solver that states levels is installed")
        before: list[tuple[float, Array]] = []
        for rung in self.rungs:
            try:
                check_needs(rung.solver.traits, rung.solver.name, at, self.setting)
                inner = asking.prepare(rung.solver, self._plan_of(rung), at)
                motion = asking.solve(rung.solver, inner, loads)
            except (InputError, RefusedError) as refused:
                refusal = refused
                continue
            found = _Prepared(solver=rung.solver, inner=inner)
            coarser = [velocity for claim, velocity in before if claim >= _WORTH_TRYING * rung.claim]
            agreed = any(self._agree(velocity, motion.velocity, at.radii) for velocity in coarser)
            if agreed or _DOUBT * rung.trust * motion.report.error <= self.accuracy:
                break
            before.append((rung.claim, motion.velocity))
        if found is None:
            raise refusal
        return found

    def _agree(self, coarse: Array, fine: Array, radii: Array) -> bool:
        """Tell whether answers (N, 6, k) differ by less than is allowed, so that the finer one is right for sure."""
        apart = [relative_error(coarse[..., k], fine[..., k], radii) for k in range(fine.shape[-1])]
        return max(apart) <= self.accuracy

    def _plan_of(self, rung: Rung) -> Any:
        if rung.label not in self.plans:
            self.plans[rung.label] = rung.solver.plan(self.setting)
        return self.plans[rung.label]


def _tried_loads(setting: Setting, at: Configuration) -> Array:
    """Give loads (N, 6, 2) that turn and mirror with the spheres: weights, and none or, without flow, a squeeze."""
    n, radius = len(at.radii), float(at.radii.max())
    force = unit_load(setting.viscosity, radius, abs(setting.shear_rate) * radius)[0]
    loads = np.zeros((n, 6, 2))
    loads[:, 2, 0] = -force * at.radii / radius
    if setting.shear_rate == 0:
        between = at.centres[None] - at.centres[:, None]
        distance = np.linalg.norm(between, axis=2) + np.where(np.eye(n) > 0, np.inf, 0.0)
        loads[:, :3, 1] = force * np.sum(between * (at.radii[None, :, None] / distance[..., None] ** 2), axis=1)
    return loads


@hookimpl
def mpad_mobility_solvers() -> list[type[MobilitySolver]]:
    """Give the solver."""
    return [Auto]
