"""Piecewise cubic tables of plain numpy functions, good to a stated relative error, for use in compiled loops.

A table's pieces end at the breakpoints of its functions. In each cell a function is replaced by the cubic through four
equally spaced points, the ends among them; cells are halved until the error between the points is small everywhere.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mpad_core.arrays import Array, Indices
from mpad_core.numerics.compiled import compiled_inline

Function = Callable[[Array], Array]

_NODES = np.array([0.0, 1 / 3, 2 / 3, 1.0])
_BETWEEN = np.array([0.02, 0.1273, 1 / 6, 0.5, 5 / 6, 0.8727, 0.98])  # a cubic through the nodes errs most at 0.1273
_TO_POWERS = np.linalg.inv(np.vander(_NODES, 4, increasing=True))  # values at the nodes -> coefficients
_MOST_CELLS = 1 << 15


class Tables(NamedTuple):
    """Cubics over cells for any number of tables, none included: arrays only, so that compiled code takes it as data.

    For table k, row ``last[k - 1] + 1`` of ``coefficients`` continues below the first edge and row ``last[k]`` above
    the last edge, both in the distance from that edge; the rows between are cells in their own coordinate, 0 to 1.
    """

    edges: Array  # (tables, pieces + 1), filled up with infinity
    first: Indices  # (tables, pieces + 1) row of each piece's first cell; then the row that continues above
    per_length: Array  # (tables, pieces) cells per unit of length
    pieces: Indices  # (tables,)
    coefficients: Array  # (rows, columns, 4)


class TableError(ValueError):
    """A function that no table of reasonable size follows to the error asked for."""


def no_tables(columns: int) -> Tables:
    """Give the tables of an absent effect."""
    none = np.zeros(0, np.int64)
    return Tables(np.zeros((0, 2)), np.zeros((0, 2), np.int64), np.zeros((0, 1)), none, np.zeros((0, columns, 4)))


def _points(lower: float, upper: float, cells: int, nodes: Array) -> Array:
    """Give the points (cells, nodes), kept just inside the piece, where a kink cannot be seen from the other side."""
    width = (upper - lower) / cells
    points = lower + width * (np.arange(cells)[:, None] + nodes)
    return np.clip(points, np.nextafter(lower, upper), np.nextafter(upper, lower))


def _piece(functions: Sequence[Function], lower: float, upper: float, error: float) -> Array:
    """Give the coefficients (cells, columns, 4) of one piece."""
    cells = 16
    while cells <= _MOST_CELLS:
        values = np.stack([f(_points(lower, upper, cells, _NODES)) for f in functions], axis=1)
        coefficients: Array = values @ _TO_POWERS.T
        truth = np.stack([f(_points(lower, upper, cells, _BETWEEN)) for f in functions], axis=1)
        wrong = np.abs(coefficients @ np.vander(_BETWEEN, 4, increasing=True).T - truth)
        # rounding of a function's own argument is not the table's error: 1e-13 of the largest value in the cell
        allowed = error * np.abs(truth) + 1e-13 * np.abs(values).max(axis=2, keepdims=True)
        if np.isfinite(values).all() and (wrong <= allowed).all():
            return coefficients
        cells *= 2
    raise TableError(f"not followed to {error:g} between {lower:.6g} and {upper:.6g}; is a breakpoint missing there?")


def tabulate(functions: Sequence[Function], edges: Sequence[float], *, error: float, tangents: Sequence[int]) -> Tables:
    """Tabulate functions of one variable over the pieces between `edges`.

    Parameters
    ----------
    functions
        Elementwise numpy functions, one a column.
    edges
        Both ends and every breakpoint between, ascending.
    error
        Largest relative error between the nodes.
    tangents
        Columns that are continued by their tangent beyond the ends; the others by their last value.

    Raises
    ------
    TableError
        If a piece would need more than 32768 cells: a breakpoint is missing, or a function is not finite.
    """
    pieces = [_piece(functions, low, high, error) for low, high in pairwise(edges)]
    counts = np.array([len(piece) for piece in pieces])
    widths = np.diff(edges)
    below, above = np.zeros((2, 1, len(functions), 4))
    below[0, :, 0] = pieces[0][0, :, 0]
    above[0, :, 0] = pieces[-1][-1].sum(axis=1)
    for column in tangents:
        below[0, column, 1] = pieces[0][0, column, 1] * counts[0] / widths[0]
        above[0, column, 1] = pieces[-1][-1, column] @ np.arange(4.0) * counts[-1] / widths[-1]
    first = 1 + np.concatenate([[0], np.cumsum(counts)])
    coefficients = np.concatenate([below, *pieces, above])
    return Tables(np.array([edges]), first[None], (counts / widths)[None], np.array([len(pieces)]), coefficients)


def together(tables: Sequence[Tables], columns: int) -> Tables:
    """Put tables of equal columns into one, in their order."""
    if not tables:
        return no_tables(columns)
    most = max(int(table.pieces.max()) for table in tables)
    rows = np.cumsum([0] + [len(table.coefficients) for table in tables])

    def filled(name: str, width: int, value: float) -> Array:
        parts = [getattr(table, name) for table in tables]
        return np.concatenate(
            [np.pad(part, ((0, 0), (0, width - part.shape[1])), constant_values=value) for part in parts]
        )

    first = filled("first", most + 1, 0) + rows[:-1, None]
    return Tables(
        filled("edges", most + 1, np.inf),
        first.astype(np.int64),
        filled("per_length", most, 0.0),
        np.concatenate([table.pieces for table in tables]),
        np.concatenate([table.coefficients for table in tables]),
    )


@compiled_inline
def locate(tables: Tables, k: int, x: float) -> tuple[int, float, float]:
    """Give the row of x in table k, its coordinate there, and the coordinate's derivative."""
    pieces = tables.pieces[k]
    if x < tables.edges[k, 0]:
        return tables.first[k, 0] - 1, x - tables.edges[k, 0], 1.0
    if x >= tables.edges[k, pieces]:
        return tables.first[k, pieces], x - tables.edges[k, pieces], 1.0
    piece = 0
    while x >= tables.edges[k, piece + 1]:
        piece += 1
    scale = tables.per_length[k, piece]
    place = (x - tables.edges[k, piece]) * scale
    cell = min(int(place), tables.first[k, piece + 1] - tables.first[k, piece] - 1)
    return tables.first[k, piece] + cell, place - cell, scale


@compiled_inline
def value(tables: Tables, k: int, column: int, x: float) -> float:
    """Look one column of table k up at x."""
    row, t, _ = locate(tables, k, x)
    c = tables.coefficients
    c0, c1, c2, c3 = c[row, column, 0], c[row, column, 1], c[row, column, 2], c[row, column, 3]
    result: float = c0 + t * (c1 + t * (c2 + t * c3))
    return result


@compiled_inline
def value_and_slope(tables: Tables, k: int, column: int, x: float) -> tuple[float, float]:
    """Look one column of table k up at x, with its derivative."""
    row, t, scale = locate(tables, k, x)
    c = tables.coefficients
    c0, c1, c2, c3 = c[row, column, 0], c[row, column, 1], c[row, column, 2], c[row, column, 3]
    return c0 + t * (c1 + t * (c2 + t * c3)), scale * (c1 + t * (2 * c2 + 3 * t * c3))
