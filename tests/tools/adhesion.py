"""Closed forms of adhesion kinetics; lengths in µm, forces in pN, times in s."""

import numpy as np
from scipy.integrate import quad
from scipy.special import exp1

from mpad_core.numerics.wall_functions import FPERP, wall_functions_array


def cluster_lifetime(number, force, rebinding):
    """Give the mean lifetime, by 1/k0, of a cluster of parallel bonds that share a constant force, all closed at first.

    i closed bonds break at i exp(f/i) and form at γ (N − i); with none it is over (Erdmann and Schwarz, Phys. Rev.
    Lett. 92 (2004) 108102). `force` is f in units of kT/r0. In floating point, since the products reach 1e158 for 100.
    """
    closed = np.arange(1.0, number + 1)
    off = closed * np.exp(force / closed)
    on = rebinding * (number - closed)
    # the mean time from i to i − 1 follows from that of i + 1, downwards
    total = step = 0.0
    for i in range(number - 1, -1, -1):
        step = (1 + on[i] * step) / off[i]
        total += step
    return total


class Ramp:
    """Rupture of a Bell bond under F = r t (Evans and Ritchie, Biophys. J. 72 (1997) 1541)."""

    def __init__(self, off_rate, force_scale, loading):
        self.scale, self.z = force_scale, off_rate * force_scale / loading

    def used(self, force):
        """Give the hazard used up before a force."""
        return self.z * np.expm1(force / self.scale)

    @property
    def mean(self):
        """Give the mean rupture force, f_b e^z E1(z)."""
        return self.scale * np.exp(self.z) * exp1(self.z)

    @property
    def mode(self):
        """Give the most likely rupture force."""
        return self.scale * max(np.log(1 / self.z), 0.0)

    @property
    def deviation(self):
        """Give the standard deviation, by ⟨F²⟩ = ∫ 2 F S dF."""
        end = self.scale * np.log1p(50 / self.z)
        square, _ = quad(lambda f: 2 * f * np.exp(-self.used(f)), 0, end, epsrel=1e-10, limit=200)
        return float(np.sqrt(square - self.mean**2))


class CatchSlip:
    """A linear spring whose bond breaks along two paths, one that force closes and one that it opens.

    k = k_c exp(−x_c F/kT) + k_s exp(x_s F/kT) (Pereverzev et al., Biophys. J. 89 (2005) 1446); rates in 1/s, x in µm.
    """

    name = "catch-slip of a test"

    def __init__(self, kT, stiffness=1e5, rest_length=0.03, catch=(120.0, 2.17e-3), slip=(0.25, 0.51e-3)):
        self.kT, self.stiffness, self.rest_length, self.catch, self.slip = kT, stiffness, rest_length, catch, slip

    def at_force(self, force):
        """Give the off-rate at a tension."""
        (kc, xc), (ks, xs) = self.catch, self.slip
        return kc * np.exp(-xc * force / self.kT) + ks * np.exp(xs * force / self.kT)

    def tension(self, length):
        """Give the spring's tension."""
        return self.stiffness * (length - self.rest_length)

    def off_rate(self, length):
        """Give the off-rate at a length."""
        return self.at_force(np.abs(self.tension(length)))

    def breakpoints(self):
        """Give the kinks."""
        return (self.rest_length,)


def hazard_under_ramp(off_rate_at, loading, forces):
    """Give ∫ k(F) dF / r from zero to each of the forces (ascending order not needed), by quadrature."""
    top = float(np.max(forces))
    grid = np.linspace(0, top, 20_001)
    middle = off_rate_at(0.5 * (grid[1:] + grid[:-1]))
    rates = off_rate_at(grid)
    pieces = (rates[1:] + 4 * middle + rates[:-1]) / 6 * np.diff(grid)
    return np.interp(forces, grid, np.concatenate([[0.0], np.cumsum(pieces)])) / loading


def fall_time(high, low, radius, viscosity, weight):
    """Give ∫ ζ/W from one gap to another, the mean time of first passage at any temperature if high gaps reflect.

    The deterministic time of falling, too; ζ(z) is the exact drag of a sphere that moves towards a wall.
    """

    def drag(gap):
        resistance = wall_functions_array(np.array([gap / radius]))[0, FPERP]
        return float(6 * np.pi * viscosity * radius * resistance)

    return float(quad(drag, low, high, epsrel=1e-10)[0] / weight)
