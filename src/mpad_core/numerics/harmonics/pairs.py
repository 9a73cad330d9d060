r"""What every two spheres send each other, directly and by way of the wall, both halves in one product; compiled.

For the pair of a target i and a source j the block is

    T_ij = Z^T D^T A D Z  +  Z^T D'^T A' D' Z Im_j

with Z the turn about z that brings the two into one plane, D that about y that puts the z-axis along their line (D'
along the line from the image of j), A the move along that line (`translation`), Im_j the image of j (`image`). In the
units of `layout` the block of (j, i) is its transpose, so that the grand mobility is symmetric to rounding, whatever
the degrees.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled, compiled_parallel, compiled_sums
from mpad_core.numerics.harmonics.image import RAISE, REACH, add_image_transposed, image_of
from mpad_core.numerics.harmonics.layout import V, W, lowest, place, places
from mpad_core.numerics.harmonics.translation import axial_blocks, axial_size, count
from mpad_core.numerics.harmonics.turning import add_turned_back, turn_about_z, turn_blocks, turn_size, turn_start

TARGET, SOURCE, TARGET_DEGREE, SOURCE_DEGREE, TURNS, AXIAL, WALL_TURNS, WALL_AXIAL = range(8)
"""Columns of `Pairs.rows`."""


SERIAL, SHARES = 400, 8
"""Pairs below which waking threads costs more than it gains, and the shares that more are dealt in."""


class Pairs(NamedTuple):
    """Blocks of all pairs in flat arrays; `rows` (P, 8) says whose they are, of which degrees, and where they start."""

    rows: Indices
    azimuth: Array  # (P, 2): cosine and sine of the azimuth of the line from source to target
    turns: Array
    axial: Array


class Places(NamedTuple):
    """Where each sphere's coefficients and its image operator start; the last entry is the length."""

    degrees: Indices  # (N,)
    own: Indices  # (N+1,)
    operator: Indices


@compiled
def places_of(degrees: Indices, wall: bool) -> Places:
    """Lay out spheres of these degrees."""
    n = len(degrees)
    own, operator = np.zeros((2, n + 1), dtype=np.int64)
    for i in range(n):
        own[i + 1] = own[i] + 6 * places(degrees[i])
        operator[i + 1] = operator[i] + (9 * REACH * places(degrees[i]) if wall else 0)
    return Places(degrees, own, operator)


@compiled
def empty_pairs(who: Indices, degrees: Indices, wall: bool) -> Pairs:
    """Lay out the blocks of pairs (P, 2) of target and source with degrees (P, 2)."""
    index = np.zeros((len(who), 8), dtype=np.int64)
    turns, axial = 0, 0
    for k in range(len(who)):
        p, q = degrees[k]
        index[k, TARGET], index[k, SOURCE] = who[k]
        index[k, TARGET_DEGREE], index[k, SOURCE_DEGREE] = p, q
        index[k, TURNS], index[k, AXIAL] = turns, axial
        turns += turn_size(max(p, q))
        axial += axial_size(p, q)
        index[k, WALL_TURNS], index[k, WALL_AXIAL] = turns, axial
        if wall:
            turns += turn_size(max(p, q + RAISE))
            axial += axial_size(p, q + RAISE)
    return Pairs(index, np.empty((len(who), 2)), np.empty(turns), np.empty(axial))


@compiled
def pairs_of(centres: Array, radii: Array, who: Indices, degrees: Indices, wall: bool) -> Pairs:
    """Give turns, moves and azimuths of pairs (P, 2) of target and source with degrees (P, 2)."""
    pairs = empty_pairs(who, degrees, wall)
    for k in range(len(pairs.rows)):
        row = pairs.rows[k]
        i, j, p, q = row[TARGET], row[SOURCE], row[TARGET_DEGREE], row[SOURCE_DEGREE]
        x, y, z = centres[i, 0] - centres[j, 0], centres[i, 1] - centres[j, 1], centres[i, 2] - centres[j, 2]
        flat = math.sqrt(x * x + y * y)
        pairs.azimuth[k, 0] = x / flat if flat > 0 else 1.0
        pairs.azimuth[k, 1] = y / flat if flat > 0 else 0.0
        turn_blocks(max(p, q), -math.atan2(flat, z), pairs.turns[row[TURNS] :])
        axial_blocks(p, radii[i], q, radii[j], math.sqrt(flat * flat + z * z), pairs.axial[row[AXIAL] :])
        if wall:
            z = centres[i, 2] + centres[j, 2]
            turn_blocks(max(p, q + RAISE), -math.atan2(flat, z), pairs.turns[row[WALL_TURNS] :])
            distance = math.sqrt(flat * flat + z * z)
            axial_blocks(p, radii[i], q + RAISE, radii[j], distance, pairs.axial[row[WALL_AXIAL] :])
    return pairs


@compiled
def frame_start(p: int, m: int) -> int:
    """Give where order m starts in the layout by orders: 6 rows, class by family, of `count` degrees for each m."""
    before = 0
    for order in range(m):
        before += 6 * count(p, order)
    return before


@compiled_sums
def to_frame(p: int, turns: Array, y: Array, out: Array) -> None:
    """Turn coefficients y (2, 3, T) about y into the layout by orders."""
    for n in range(1, p + 1):  # slices of this degree: their indices need no check of sign
        width, here, first = n + 1, slice(place(n, 0), place(n, 0) + n + 1), 0
        even_v, even_w, even_x = y[0, 0, here], y[0, 1, here], y[0, 2, here]
        odd_v, odd_w, odd_x = y[1, 0, here], y[1, 1, here], y[1, 2, here]
        for k in range(width):
            row = turn_start(n) + k * width
            cosines, sines = turns[row : row + width], turns[row + width * width : row + width * width + width]
            v, w, x, other_v, other_w, other_x = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for m in range(width):  # all six at once: short loops cost more than their sums
                v += cosines[m] * even_v[m]
                w += cosines[m] * even_w[m]
                x += sines[m] * even_x[m]
                other_v += sines[m] * odd_v[m]
                other_w += sines[m] * odd_w[m]
                other_x += cosines[m] * odd_x[m]
            have = count(p, k)
            to = first + n - lowest(k)
            out[to], out[to + have], out[to + 2 * have] = v, w, x
            out[to + 3 * have], out[to + 4 * have], out[to + 5 * have] = other_v, other_w, other_x
            first += 6 * have


@compiled_sums
def from_frame(p: int, turns: Array, z: Array, out: Array) -> None:
    """Undo `to_frame`, by the transpose."""
    out[:, :, : places(p)] = 0.0
    for n in range(1, p + 1):
        width, here, first = n + 1, slice(place(n, 0), place(n, 0) + n + 1), 0
        even_v, even_w, even_x = out[0, 0, here], out[0, 1, here], out[0, 2, here]
        odd_v, odd_w, odd_x = out[1, 0, here], out[1, 1, here], out[1, 2, here]
        for k in range(width):
            row, have = turn_start(n) + k * width, count(p, k)
            cosines, sines = turns[row : row + width], turns[row + width * width : row + width * width + width]
            of = first + n - lowest(k)
            v, w, x = z[of], z[of + have], z[of + 2 * have]
            other_v, other_w, other_x = z[of + 3 * have], z[of + 4 * have], z[of + 5 * have]
            first += 6 * have
            for m in range(width):
                even_v[m] += cosines[m] * v
                even_w[m] += cosines[m] * w
                even_x[m] += sines[m] * x
                odd_v[m] += sines[m] * other_v
                odd_w[m] += sines[m] * other_w
                odd_x[m] += cosines[m] * other_x


@compiled_sums
def move_both(p: int, q: int, axial: Array, up: Array, down: Array, onto_up: Array, onto_down: Array) -> None:
    """Multiply with the axial blocks both ways, between targets `up` (degree p) and sources `down` (degree q)."""
    onto_up[: frame_start(p, p + 1)] = 0.0
    onto_down[: frame_start(q, q + 1)] = 0.0
    at, t, s = 0, 0, 0
    for m in range(min(p, q) + 1):
        rows, columns = count(p, m), count(q, m)
        for f in range(3):  # V has W for source, W all three, X has W and X
            first = s + (0 if f == W else columns)
            width = s + (2 * columns if f == V else 3 * columns) - first
            other = first + 3 * columns
            even, odd = down[first : first + width], down[other : other + width]
            onto_even, onto_odd = onto_down[first : first + width], onto_down[other : other + width]
            for r in range(t + f * rows, t + (f + 1) * rows):
                row, up_even, up_odd = axial[at : at + width], up[r], up[r + 3 * rows]
                of_even, of_odd = 0.0, 0.0
                for k in range(width):
                    of_even += row[k] * even[k]
                    of_odd += row[k] * odd[k]
                for k in range(width):  # apart: the compiler cannot know that reading and writing do not overlap
                    onto_even[k] += row[k] * up_even
                for k in range(width):
                    onto_odd[k] += row[k] * up_odd
                onto_up[r] += of_even
                onto_up[r + 3 * rows] += of_odd
                at += width
        t, s = t + 6 * rows, s + 6 * columns


@compiled_sums
def exchange(p: int, q: int, turns: Array, axial: Array, up: Array, down: Array, work: Array) -> None:
    """Replace coefficients `up` and `down` (2, 3, T), already turned about z, by what each gets from the other."""
    to_frame(p, turns, up, work[0])
    to_frame(q, turns, down, work[1])
    move_both(p, q, axial, work[0], work[1], work[2], work[3])
    from_frame(p, turns, work[2], up)
    from_frame(q, turns, work[3], down)


@compiled
def workspace(degrees: Indices) -> tuple[Array, Array]:
    """Give room for `exchange`: four arrays of coefficients and four in the layout by orders."""
    top = degrees.max() + RAISE
    return np.empty((4, 2, 3, places(top))), np.empty((4, frame_start(top, top + 1)))


@compiled_sums
def _copy(y: Array, out: Array) -> None:
    for c in range(2):
        for f in range(3):
            for k in range(y.shape[2]):  # numpy's assignment would compile the message of its error, for seconds
                out[c, f, k] = y[c, f, k]


@compiled_sums
def _add(y: Array, out: Array) -> None:
    for c in range(2):
        for f in range(3):
            for k in range(y.shape[2]):
                out[c, f, k] += y[c, f, k]


@compiled_sums
def _some(at: Places, pairs: Pairs, operators: Array, wall: bool, y: Array, first: int, last: int, out: Array) -> None:
    """Add what the pairs from `first` to before `last` send each other."""
    z, work = workspace(at.degrees)
    for k in range(first, last):
        row = pairs.rows[k]
        i, j, p, q = row[TARGET], row[SOURCE], row[TARGET_DEGREE], row[SOURCE_DEGREE]
        cosine, sine = pairs.azimuth[k]
        ti, tj = places(at.degrees[i]), places(at.degrees[j])
        source = y[at.own[j] : at.own[j + 1]].reshape(2, 3, tj)
        onto_source = out[at.own[j] : at.own[j + 1]].reshape(2, 3, tj)
        turn_about_z(p, cosine, sine, y[at.own[i] : at.own[i + 1]].reshape(2, 3, ti), z[0])
        _copy(z[0], z[2])
        turn_about_z(q, cosine, sine, source, z[1])
        exchange(p, q, pairs.turns[row[TURNS] :], pairs.axial[row[AXIAL] :], z[0], z[1], work)
        add_turned_back(q, cosine, sine, z[1], onto_source)
        if wall:
            operator = operators[at.operator[j] : at.operator[j + 1]].reshape(tj, REACH, 3, 3)
            image_of(q, operator, source, z[3])
            turn_about_z(q + RAISE, cosine, sine, z[3], z[1])
            turns, axial = pairs.turns[row[WALL_TURNS] :], pairs.axial[row[WALL_AXIAL] :]
            exchange(p, q + RAISE, turns, axial, z[2], z[1], work)
            _add(z[2], z[0])
            z[3] = 0.0
            add_turned_back(q + RAISE, cosine, sine, z[1], z[3])
            add_image_transposed(q, operator, z[3], onto_source)
        add_turned_back(p, cosine, sine, z[0], out[at.own[i] : at.own[i + 1]].reshape(2, 3, ti))


@compiled_parallel
def pair_product(at: Places, pairs: Pairs, operators: Array, wall: bool, y: Array, out: Array) -> None:
    """Write what every sphere gets from all others, directly and by their images.

    Where pairs are many, they are dealt in shares to the threads, whose sums are kept apart: the bits do not depend on
    the number of threads.

    Parameters
    ----------
    at, pairs
        Spheres and blocks.
    operators
        Flat array of the `image_operator` of each sphere, as `at.operator` says; not read without a wall.
    wall
        Whether there is one.
    y, out : (at.own[-1],)
        Sources, and traces, written.
    """
    count = len(pairs.rows)
    for e in range(len(out)):
        out[e] = 0.0
    if count < SERIAL:
        _some(at, pairs, operators, wall, y, 0, count, out)
        return
    parts = np.zeros((SHARES, len(out)))
    for share in numba.prange(SHARES):
        _some(at, pairs, operators, wall, y, share * count // SHARES, (share + 1) * count // SHARES, parts[share])
    for share in range(SHARES):
        for e in range(len(out)):
            out[e] += parts[share, e]
