"""Random spheres near contact with each other and the wall, and how far an answer about them is from another."""

import numpy as np
from scipy.linalg import eigh


def log_uniform(rng, low, high, size=None):
    """Draw numbers whose logarithms are uniform."""
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def wide_or_equal(rng, ratio):
    """Draw the smaller of two radii, the larger being 1: a third of them at the extreme ratio."""
    return 1 / ratio if rng.random() < 1 / 3 else rng.uniform(1 / ratio, 1)


def two_at_the_wall(rng, ratio, low=1e-3, high=1.0):
    """Give centres and radii of two spheres above the wall, all three gaps log-uniform over the radius they belong to.

    Gaps are in radii of the sphere at the wall, or of the smaller one of the two. Half of the pairs have the
    inclination that three independent gaps leave them, and lie along any direction; half have any orientation, and
    one gap to the wall follows from it.
    """
    radii = rng.permutation([1.0, wide_or_equal(rng, ratio)])
    any_orientation = rng.random() < 0.5
    while True:
        heights = radii * (1 + log_uniform(rng, low, high, 2))
        reach = radii.sum() + log_uniform(rng, low, high) * radii.min()
        if any_orientation:
            offset = rng.normal(size=3)
            offset *= reach / np.linalg.norm(offset)
        elif abs(heights[1] - heights[0]) > reach:
            continue
        else:
            angle, rise = rng.uniform(0, 2 * np.pi), heights[1] - heights[0]
            across = np.sqrt(reach**2 - rise**2)
            offset = np.array([across * np.cos(angle), across * np.sin(angle), rise])
        if heights[0] + offset[2] >= (1 + low) * radii[1]:
            first = np.array([0.0, 0.0, heights[0]])
            return np.array([first, first + offset]), radii


def grown(rng, count, ratio, low, high, wall=True):
    """Give centres and radii of spheres grown one upon another.

    Each is at a gap log-uniform between low and high (smaller radii) from one before; where there is a wall, half of
    them are so from the wall, too (own radii), and none is closer to it or to another than `low`.
    """
    centres, radii = np.empty((0, 3)), np.empty(0)
    while len(radii) < count:
        a = 1.0 if len(radii) == 0 else wide_or_equal(rng, ratio)
        centre = np.array([0.0, 0.0, a * (1 + log_uniform(rng, low, high))])
        if len(radii):
            j, offset = rng.integers(len(radii)), rng.normal(size=3)
            reach = a + radii[j] + log_uniform(rng, low, high) * min(a, radii[j])
            offset *= reach / np.linalg.norm(offset)
            drop = centre[2] - centres[j, 2]
            if wall and rng.random() < 0.5 and abs(drop) < reach:
                offset[:2] *= np.sqrt(reach**2 - drop**2) / np.linalg.norm(offset[:2])
                offset[2] = drop
            centre = centres[j] + offset
        apart = np.linalg.norm(centres - centre, axis=1) - radii - a
        if (not wall or centre[2] - a > 0.99 * low * a) and (apart > 0.99 * low * np.minimum(radii, a)).all():
            centres, radii = np.vstack([centres, centre]), np.append(radii, a)
    return centres, radii


def velocity_error(found, true, radii):
    """Give the relative 2-norm error of (U, aΩ)."""
    weights = np.column_stack([np.ones_like(radii), radii]).repeat(3, axis=1)
    found, true = (weights * np.reshape(values, (-1, 6)) for values in (found, true))
    return np.linalg.norm(found - true) / np.linalg.norm(true)


def energy_error(found, true):
    """Give the largest |eigenvalue| of M_ref^-1/2 (M - M_ref) M_ref^-1/2."""
    return np.abs(eigh(found + found.T - true - true.T, true + true.T, eigvals_only=True)).max()


def stokes_units(radii):
    """Give (6N,) the roots of Stokes' mobilities at unit viscosity, by which matrices are scaled on both sides."""
    linear, angular = 1 / (6 * np.pi * radii), 1 / (8 * np.pi * radii**3)
    return np.sqrt(np.column_stack([linear, angular]).repeat(3, axis=1)).ravel()


def upper(matrix):
    """Give the rows of the upper triangle, as files hold them."""
    return matrix[np.triu_indices(len(matrix))]


def full(rows, size):
    """Give the symmetric matrix of these rows of its upper triangle."""
    matrix = np.zeros((size, size))
    matrix[np.triu_indices(size)] = rows
    return matrix + np.triu(matrix, 1).T
