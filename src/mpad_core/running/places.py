"""Where molecules are, and the wall's own; compiled."""

import math

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_inline, compiled_lean
from mpad_core.numerics.streams import Stream, Word, mixed, uniform, uniform_pair
from mpad_core.running.layout import Molecules

SQUARE = 0.1  # µm, side of the squares in which the wall's molecules are laid out
MOST_LIGANDS = 255  # in a square; each has a number of 8 bits
_LIGANDS = int(Stream.LIGANDS)


@compiled_inline
def height_of(site: int, centre: Array, turn: Array, molecules: Molecules) -> float:
    """Give the height of a molecule of a cell at `centre` (3,), turned by `turn` (3, 3)."""
    arm = molecules.arm
    return float(centre[2] + turn[2, 0] * arm[site, 0] + turn[2, 1] * arm[site, 1] + turn[2, 2] * arm[site, 2])


@compiled_inline
def place_of(site: int, centre: Array, turn: Array, molecules: Molecules) -> tuple[float, float, float]:
    """Give the place of a molecule of a cell at `centre` (3,), turned by `turn` (3, 3)."""
    arm = molecules.arm
    ax, ay, az = arm[site, 0], arm[site, 1], arm[site, 2]
    return (
        centre[0] + turn[0, 0] * ax + turn[0, 1] * ay + turn[0, 2] * az,
        centre[1] + turn[1, 0] * ax + turn[1, 1] * ay + turn[1, 2] * az,
        centre[2] + turn[2, 0] * ax + turn[2, 1] * ay + turn[2, 2] * az,
    )


@compiled_inline
def distance(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Give the distance of two places."""
    return math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)


@compiled_lean
def square_of(i: int, j: int) -> int:
    """Give the identity of a square of the wall; its last eight bits are free for the molecule's number."""
    return int((np.int64(i) & 0xFFFFFF) << 32 | (np.int64(j) & 0xFFFFFF) << 8)


@compiled_lean
def ligands_of(key: Word, kind: int, i: int, j: int, density: float) -> int:
    """Give the number of the wall's molecules in a square: Poisson, by inversion."""
    u = uniform(key, _LIGANDS, mixed(square_of(i, j), kind), 0)
    chance = math.exp(-density * SQUARE * SQUARE)
    total = chance
    number = 0
    while u > total and number < MOST_LIGANDS:
        number += 1
        chance *= density * SQUARE * SQUARE / number
        total += chance
    return number


@compiled_lean
def ligand_at(key: Word, kind: int, i: int, j: int, number: int) -> tuple[int, float, float, float]:
    """Give identity, x, y and mark of one of a square's molecules; the mark thins the densest to the local density."""
    u, v = uniform_pair(key, _LIGANDS, mixed(square_of(i, j), kind), 1 + number)
    ligand = square_of(i, j) | number
    return ligand, (i + u) * SQUARE, (j + v) * SQUARE, uniform(key, _LIGANDS, mixed(ligand, kind), 1000)
