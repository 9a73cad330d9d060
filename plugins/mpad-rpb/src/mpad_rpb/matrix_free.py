"""Many spheres: products with the mobility in O(N) memory, and GMRES for what makes lone spheres exact."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Motion, Report
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.krylov import Solution, gmres
from mpad_core.numerics.stokeslet_products import mobility_product
from mpad_core.numerics.stokeslets import self_mobilities
from mpad_core.numerics.wall_functions import wall_mobility, wall_shear_load
from mpad_rpb.accuracy import error_of
from mpad_rpb.lone import wall_inverse
from mpad_rpb.scene import Spheres

TOLERANCE = 1e-10  # of (w, a ω), so far below the method's own error that no bias piles up over a run


@compiled
def lone_spheres(centres: Array, radii: Array, gaps: Array, viscosity: float, shear_rate: float) -> tuple[Array, Array]:
    """Give the exact mobilities (N, 6, 6) of lone spheres and the loads (N, 6) on them when held in the flow."""
    mobilities, loads = np.empty((len(radii), 6, 6)), np.empty((len(radii), 6))
    for i in range(len(radii)):
        wall_mobility(centres[i, 2], gaps[i], radii[i], viscosity, mobilities[i])
        wall_shear_load(centres[i, 2], gaps[i], radii[i], viscosity, shear_rate, loads[i])
    return mobilities, loads


@compiled
def _inverses(blocks: Array) -> Array:
    out = np.empty_like(blocks)
    for i in range(len(blocks)):
        wall_inverse(blocks[i], out[i])
    return out


@compiled
def _each(blocks: Array, vectors: Array) -> Array:
    """Multiply each sphere's block (N, 6, 6) with its vector (N, 6)."""
    out = np.zeros_like(vectors)
    for i in range(len(vectors)):
        for k in range(6):
            for m in range(6):
                out[i, k] += blocks[i, k, m] * vectors[i, m]
    return out


def product(spheres: Spheres, loads: Array) -> Array:
    """Multiply the method's mobility, damped as `Spheres` says, with loads (N, 6)."""
    fluid = spheres.setting
    if spheres.damping is None:
        return mobility_product(spheres.centres, spheres.radii, fluid.viscosity, fluid.wall, loads)
    c = spheres.damping[:, None]
    own = self_mobilities(spheres.centres, spheres.radii, fluid.viscosity, fluid.wall)
    coupled = mobility_product(spheres.centres, spheres.radii, fluid.viscosity, fluid.wall, c * loads)
    return c * (coupled + (1 - c) * _each(own, loads))


@frozen(kw_only=True, eq=False)
class Lone:
    """The lone spheres: exact mobilities, held loads in the flow, and this method's own resistances."""

    mobility: Array  # (N, 6, 6)
    load: Array  # (N, 6)
    resistance: Array  # (N, 6, 6), of the method
    own: Array  # (N, 6, 6), its inverse
    scale: Array  # (N, 6), 1 and the radius: velocities and rotations in one norm

    @classmethod
    def of(cls, spheres: Spheres) -> "Lone":
        """Look up and invert."""
        fluid, radii = spheres.setting, spheres.radii
        mobility, load = lone_spheres(spheres.centres, radii, spheres.gaps, fluid.viscosity, fluid.shear_rate)
        own = self_mobilities(spheres.centres, radii, fluid.viscosity, fluid.wall)
        scale = np.ones((len(radii), 6))
        scale[:, 3:] = radii[:, None]
        return cls(mobility=mobility, load=load, resistance=_inverses(own), own=own, scale=scale)


def corrected(spheres: Spheres, lone: Lone, load: Array, guess: Array | None) -> tuple[Array, Solution]:
    """Solve (M⁻¹ + ΔR) U = F + ΔF + M⁻¹ u_∞ for one column of loads (N, 6).

    With f = M⁻¹ (U - u_∞), w = M_ii f, and S = M_exact R_rpb of each sphere, multiplying by M_exact gives

        w + (1 - S) v = U_lone - u_∞,    v_i = Σ_j≠i M_ij f_j,    U = U_lone + S v,

    where U_lone is the exact motion of each sphere alone: reflections between spheres, in which all is of the size of a
    velocity and 1 - S lies between zero (far from the wall) and one (contact). So the number of products hardly grows
    as a gap closes, a lone sphere takes none, and the motion towards the wall keeps its digits.
    """

    def others(w: Array) -> Array:
        return product(spheres, _each(lone.resistance, w)) - w

    def apply(y: Array) -> Array:
        w = y.reshape(load.shape) / lone.scale
        v = others(w)
        return ((w + v - through(v)) * lone.scale).reshape(-1)

    def through(v: Array) -> Array:
        return _each(lone.mobility, _each(lone.resistance, v))

    alone = _each(lone.mobility, load + lone.load)
    right = ((alone - spheres.ambient) * lone.scale).reshape(-1)
    solution = gmres(apply, right, start=guess, tolerance=TOLERANCE)
    if not solution.residual <= TOLERANCE:
        raise RefusedError(
            f"rpb: no solution after {solution.products} products (residual {solution.residual:.1e}, wanted "
            f"{TOLERANCE:.0e}): " + spheres.closest()
        )
    w = solution.x.reshape(load.shape) / lone.scale
    return alone + through(others(w)), solution


@frozen(kw_only=True, eq=False)
class MatrixFree:
    """The spheres, and what makes them exact when alone if that is wanted."""

    spheres: Spheres
    lone: Lone | None
    guess: Array | None

    @classmethod
    def of(cls, spheres: Spheres, guess: Array | None) -> "MatrixFree":
        """Prepare the lone spheres."""
        return cls(spheres=spheres, lone=Lone.of(spheres) if spheres.exact else None, guess=guess)

    def solve(self, loads: Array) -> Motion:
        """Solve for each column; warm if the guess has the shape of the loads."""
        loads = np.asarray(loads, dtype=np.float64)
        columns = loads.reshape(len(self.spheres.radii), 6, -1)
        if not np.isfinite(columns).all():
            raise RefusedError("rpb: the loads are not finite")
        flat = np.ascontiguousarray(columns.reshape(-1, columns.shape[2]))
        velocity, guess = np.empty_like(flat), np.empty_like(flat)
        products, residual = 0, 0.0
        warm = self.guess.reshape(flat.shape) if self.guess is not None and self.guess.shape == loads.shape else None
        for k in range(flat.shape[1]):
            load = np.ascontiguousarray(columns[:, :, k])
            if self.lone is None:
                velocity[:, k] = (self.spheres.ambient + product(self.spheres, load)).reshape(-1)
                continue
            start = None if warm is None else np.ascontiguousarray(warm[:, k])
            motion, solution = corrected(self.spheres, self.lone, load, start)
            velocity[:, k], guess[:, k] = motion.reshape(-1), solution.x
            products, residual = max(products, solution.products), max(residual, solution.residual)
        report = Report(error=error_of(self.spheres, flat, velocity), iterations=products, residual=residual)
        return Motion(
            velocity=velocity.reshape(loads.shape),
            report=report,
            guess=None if self.lone is None else guess.reshape(loads.shape),
        )
