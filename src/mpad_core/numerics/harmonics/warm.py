"""First guesses: coefficients kept with the degrees that they are laid out for, and laid out anew for others."""

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled
from mpad_core.numerics.harmonics.layout import places
from mpad_core.numerics.harmonics.pairs import Places


@compiled
def _copied(degrees: Indices, starts: Indices, y: Array, to_degrees: Indices, to_starts: Indices) -> Array:
    """Give coefficients (K, n) laid out for other degrees: the higher ones are dropped, or zero."""
    out = np.zeros((len(y), to_starts[-1]))
    for i in range(len(degrees)):
        t, to = places(degrees[i]), places(to_degrees[i])
        common = min(t, to)
        for row in range(6):
            of, at = starts[i] + row * t, to_starts[i] + row * to
            out[:, at : at + common] = y[:, of : of + common]
    return out


def between(source: Places, target: Places, y: Array) -> Array:
    """Give coefficients (K, n) of one layout in another."""
    return _copied(source.degrees, source.own, y, target.degrees, target.own)


def kept(at: Places, y: Array) -> Array:
    """Give coefficients (K, n) with the degrees (N) before each row, to be a guess."""
    return np.hstack([np.broadcast_to(at.degrees.astype(float), (len(y), len(at.degrees))), y])


def started(guess: Array | None, columns: int, at: Places) -> Array | None:
    """Give the coefficients (columns, n) of a guess in this layout; None if it is not one for as many spheres."""
    n = len(at.degrees)
    if guess is None or guess.ndim != 2 or len(guess) != columns or guess.shape[1] <= n:
        return None
    labels = guess[0, :n]
    if not np.isfinite(guess).all():
        return None
    degrees = labels.astype(np.int64)
    sizes = 3 * (degrees + 1) * (degrees + 2) - 6
    if (degrees != labels).any() or (degrees < 1).any() or sizes.sum() != guess.shape[1] - n:
        return None
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    return _copied(degrees, starts, np.ascontiguousarray(guess[:, n:]), at.degrees, at.own)
