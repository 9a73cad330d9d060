"""Parts with one thing wrong each: solvers around `rpb`, springs, a surface; and one solver around it that is right."""

from typing import Any, ClassVar

import numpy as np
from attrs import evolve, frozen

from mpad_core import AccuracyLevel, Array, Configuration, Motion, Report, Setting, SolverTraits, hookimpl, solver

TRAITS = SolverTraits(levels=(AccuracyLevel(parameters=(), error=0.6),))


@frozen(kw_only=True)
class Right:
    """The solver `rpb`, by its mobility matrix."""

    name: ClassVar[str] = "right"
    traits: ClassVar[SolverTraits] = TRAITS

    def plan(self, setting: Setting) -> Any:
        inner = solver("rpb")
        return inner, inner.plan(setting)

    def prepare(self, plan: Any, configuration: Configuration, guess: Array | None = None) -> Any:
        inner, ready = plan
        prepared, count = inner.prepare(ready, configuration), len(configuration.radii)
        free = inner.solve(prepared, np.zeros((count, 6))).velocity
        unit = np.eye(6 * count).reshape(count, 6, 6 * count)
        matrix = (inner.solve(prepared, unit).velocity - free[..., None]).reshape(6 * count, 6 * count)
        return inner, prepared, free, self.spoilt(matrix)

    def solve(self, prepared: Any, loads: Array) -> Motion:
        inner, ready, free, matrix = prepared
        answer = inner.solve(ready, loads)
        columns = loads.reshape(len(free) * 6, -1)
        velocity = (free.reshape(-1, 1) + matrix @ columns).reshape(loads.shape)
        return Motion(velocity=velocity, report=self.reported(answer.report))

    def spoilt(self, matrix: Array) -> Array:
        return matrix

    def reported(self, report: Report) -> Report:
        return report


@frozen(kw_only=True)
class WrongSign(Right):
    """Forces on one sphere move the others the wrong way."""

    name: ClassVar[str] = "wrong-sign"

    def spoilt(self, matrix: Array) -> Array:
        count = len(matrix) // 6
        signs = np.where(np.eye(count) == 1, 1.0, -1.0)
        return matrix * np.kron(signs, np.ones((6, 6)))


@frozen(kw_only=True)
class WrongDrag(Right):
    """Drag is 5 % too large."""

    name: ClassVar[str] = "wrong-drag"

    def spoilt(self, matrix: Array) -> Array:
        return matrix / 1.05


@frozen(kw_only=True)
class WrongSymmetry(Right):
    """A mobility with an asymmetric part, a thousandth of its largest entry."""

    name: ClassVar[str] = "wrong-symmetry"

    def spoilt(self, matrix: Array) -> Array:
        skew = np.zeros_like(matrix)
        skew[0, 1] = 1e-3 * matrix[0, 0]
        return matrix + skew


@frozen(kw_only=True)
class SaysNothing(Right):
    """Nothing wrong, but every answer may be wrong by all of itself."""

    name: ClassVar[str] = "says-nothing"
    traits: ClassVar[SolverTraits] = SolverTraits(levels=(AccuracyLevel(parameters=(), error=1.0),))

    def reported(self, report: Report) -> Report:
        return evolve(report, error=1.0)


@frozen(kw_only=True)
class Pads(Right):
    """Nothing wrong, but every answer is said to be wrong by a hundred times what it is."""

    name: ClassVar[str] = "pads"

    def reported(self, report: Report) -> Report:
        return evolve(report, error=100 * report.error)


@frozen(kw_only=True)
class Boasts(Right):
    """Claims nine digits and has two."""

    name: ClassVar[str] = "boasts"
    traits: ClassVar[SolverTraits] = SolverTraits(levels=(AccuracyLevel(parameters=(), error=1e-9),))

    def spoilt(self, matrix: Array) -> Array:
        return 1.01 * matrix

    def reported(self, report: Report) -> Report:
        return Report(error=1e-9)


@frozen(kw_only=True)
class Raises(Right):
    """Stops at three spheres."""

    name: ClassVar[str] = "raises"

    def spoilt(self, matrix: Array) -> Array:
        if len(matrix) > 12:
            raise ZeroDivisionError("no more than two")
        return matrix


@frozen(kw_only=True)
class WrongRate:
    """A spring whose off-rate is negative where it is long."""

    name: ClassVar[str] = "wrong-rate"
    rest_length: float

    def tension(self, length: Array) -> Array:
        return 1e4 * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        return 2.0 - 50.0 * (length - self.rest_length)

    def breakpoints(self) -> tuple[float, ...]:
        return (self.rest_length,)


@frozen(kw_only=True)
class WrongShape(WrongRate):
    """A spring that pulls harder where more lengths are asked for."""

    name: ClassVar[str] = "wrong-shape"

    def tension(self, length: Array) -> Array:
        return 1e4 * np.size(length) * (length - self.rest_length)

    def off_rate(self, length: Array) -> Array:
        return 2.0 + 0 * length


@frozen(kw_only=True)
class WrongBound:
    """A surface that is denser than it says."""

    name: ClassVar[str] = "wrong-bound"
    density_bound: float = 150.0

    def density(self, x: Array, y: Array) -> Array:
        return 100.0 * (1 + np.sin(x)) + 0 * y

    def densest(self) -> float:
        return self.density_bound


@hookimpl
def mpad_mobility_solvers() -> list[Any]:
    return [Right, WrongSign, WrongDrag, WrongSymmetry, SaysNothing, Pads, Boasts, Raises]


@hookimpl
def mpad_bond_models() -> list[Any]:
    return [WrongRate, WrongShape]


@hookimpl
def mpad_surfaces() -> list[Any]:
    return [WrongBound]
