"""Encounter of molecules on surfaces that slip past each other, after Chang & Hammer (Biophys J 76:1280, 1999).

Its table for compiled code is made in `mpad_core.physics.reactions`, so that checking a scene compiles nothing.
"""

import numpy as np
from attrs import frozen
from scipy.special import ive, kve

from mpad_core.arrays import Array

_FAR = 16.0  # Péclet number: here terms of the series are 1e6 times their sum, and the asymptote is good to 1e-7
_SHADOW = (1.0, 0.99619318, 0.02235312, 0.01458652, -0.0097789, 0.0035869)  # M_m; they fit the series at 16 < Pe < 40
_TERMS = 60  # for a Péclet number of 16, the last one is 1e-40 of the first


def nusselt(peclet: Array) -> Array:
    """Give what a disc in a stream on a plane catches of what diffuses there, by π D times the density far away.

    Nu = 2 Σ_n (−1)^n I_n(z) / K_n(z) over all whole n, z = Pe/2, for a perfectly absorbing disc. The terms alternate
    and grow as exp(Pe), so where they cancel the asymptote takes over: as for the shadow of a disc in waves of length
    2π/k (Wu, Phys Rev 104:1201, 1956), with ik for z, Nu = (4z/π) Σ_m M_m z^(−2m/3): first what lies in the swath.

    Parameters
    ----------
    peclet : (...)
        Péclet numbers Pe = b V / D of a disc of radius b; not negative.
    """
    z = 0.5 * np.asarray(peclet, float)
    near, far = _series(np.clip(z, 1e-300, _FAR / 2)), _asymptote(np.maximum(z, _FAR / 2))
    return np.where(z > 0, np.where(z < _FAR / 2, near, far), 0.0)


def _series(z: Array) -> Array:
    n = np.arange(_TERMS).reshape(-1, *[1] * z.ndim)
    with np.errstate(over="ignore"):  # K_n of a small argument is infinite: the term is nothing
        terms = ive(n, z) / kve(n, z) * np.exp(2 * z)
    total: Array = 2 * (2 * (terms * (-1.0) ** n).sum(axis=0) - terms[0])
    return total


def _asymptote(z: Array) -> Array:
    total: Array = 4 * z / np.pi * np.polynomial.polynomial.polyval(z ** (-2 / 3), _SHADOW)
    return total


@frozen(kw_only=True)
class ChangHammer:
    """The on-rate grows with the slip speed V, from encounter by diffusion to as fast as molecules react.

    A receptor is an absorbing disc of radius b on one surface; ligands of the other stream past it at V and diffuse
    with D. In the disc they react at a rate k_in each, so if the disc were never depleted the on-rate for unit density
    of ligands would be π b² k_in. It is depleted: a fraction P = Λδ / (1 + Λδ) of the encounters, π D Nu(Pe), react,
    δ = b² k_in / D being the Damköhler number and Λ the time of an encounter by b²/D. For slow reaction π D Nu Λ δ must
    be π b² k_in, so Λ = 1 / Nu (this limit fixes it; it is derived here, not read in the paper), and

        k_on = π D Nu P = π b² k_in / (1 + δ / Nu).

    Nu grows without bound, so the on-rate of fast slip is π b² k_in. The factor is k_on by that one,
    1 / (1 + δ / Nu(bV / D)), so the scene's on-rate is meant as that of reaction alone. A plane has no steady encounter
    without slip, Nu(0) = 0, but it takes hold as slowly as a logarithm.

    Attributes
    ----------
    radius
        b in µm.
    diffusivity
        D in µm²/s, of one molecule relative to the other.
    reaction_rate
        k_in in 1/s.
    """

    radius: float
    diffusivity: float
    reaction_rate: float

    def factor(self, slip_speed: Array) -> Array:
        """Give the factor on the on-rate at slip speeds (µm/s); zero at none, one for the fastest."""
        caught = nusselt(self.radius * np.abs(slip_speed) / self.diffusivity)
        damkoehler = self.radius**2 * self.reaction_rate / self.diffusivity
        factor: Array = caught / (caught + damkoehler) if damkoehler > 0 else np.ones_like(caught)
        return factor
