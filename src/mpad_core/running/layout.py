"""The data of the burst: named tuples of arrays, which compiled code takes as they are.

An effect that the scene leaves out is a table or list of length zero here; the code never asks.
"""

from typing import NamedTuple

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.numerics.streams import Word
from mpad_core.numerics.tables import Tables


class Bodies(NamedTuple):
    """What stays with the cells; N of them."""

    radius: Array  # (N,) µm, smooth sphere
    roughness: Array  # (N,) µm, height of the bumps
    external: Array  # (N, 6) pN, pN µm: constant loads
    wall_offset: float  # µm added to every gap before the wall functions: 0, or so much that the wall is not felt
    wall_tips: float  # µm, height of the wall's roughness layer
    viscosity: float  # pN s/µm²
    shear_rate: float  # 1/s


class Molecules(NamedTuple):
    """The binding sites fixed on the cells; S of them, those of one cell after those of the cell before."""

    arm: Array  # (S, 3) µm, from the cell's centre to the molecule, in the cell's frame
    first: Indices  # (N + 1,) each cell's first molecule
    kind: Indices  # (S,) which kind of site
    owner: Indices  # (N,) each cell's identity in draws, which does not depend on the other cells


class Species(NamedTuple):
    """The kinds of bond; K of them."""

    tables: Tables  # columns: tension (pN), off-rate (1/s), on-rate (1/s) over length (µm)
    site_kind: Indices  # (K,) which kind of site on the cell takes part
    reach: Array  # (K,) µm, tip gap beyond which no bond forms
    least_length: Array  # (K,) µm, length that a bond is at least born with (tilted if need be)
    pairwise: Flags  # (K,) whether the wall's molecules are told apart
    ligand_density: Array  # (K,) 1/µm², densest of the wall's molecules that are told apart


class Bonds(NamedTuple):
    """Living bonds, in the order of their birth; room for B."""

    living: Indices  # (1,) how many
    cell: Indices  # (B,)
    site: Indices  # (B,) index into Molecules
    species: Indices  # (B,)
    ligand: Indices  # (B,) identity of the wall's molecule, -1 where not told apart
    anchor: Array  # (B, 3) µm, where the bond holds the wall


class Contacts(NamedTuple):
    """Repulsion between roughness layers."""

    law: Tables  # one table or none; column: force (pN) over tip gap (µm)
    reach: float  # µm, tip gap beyond which there is no force; minus infinity without a law
    pairs: Indices  # (P, 2) cells that may come into contact during the burst, in the order of the first one's group
    pair_first: Indices  # (groups + 1,) each group's first pair


class Groups(NamedTuple):
    """Free cells whose coupling is solved together; the coupling is frozen during a burst."""

    cells: Indices  # (free cells,)
    first: Indices  # (groups + 1,)
    place: Indices  # (N,) each cell's place in its group; -1 for a held cell
    coupling: Array  # all groups' coupling resistances C, one after the other, flattened
    coupling_first: Indices  # (groups + 1,)
    load: Array  # (N, 6) k + g: what the coupling adds to the loads


class Thermal(NamedTuple):
    """Thermal motion."""

    energy: Array  # (1,) kT, pN µm; (0,) where there is no thermal motion


class System(NamedTuple):
    """All that a burst reads and does not change."""

    bodies: Bodies
    molecules: Molecules
    species: Species
    contacts: Contacts
    groups: Groups
    thermal: Thermal
    density_ratio: Array  # (N, K) the wall's site density under each cell, by the one that the on-rate is given at


class Attached(NamedTuple):
    """The living bonds sorted by cell, with their arms turned into space; rebuilt every sub-step."""

    first: Indices  # (N + 1,) each cell's first place in the order
    order: Indices  # (B,) bonds
    arm: Array  # (B, 3) µm


class Motion(NamedTuple):
    """What the burst changes."""

    centre: Array  # (N, 3) µm
    gap: Array  # (N,) µm, smooth sphere to wall
    orientation: Array  # (N, 4)
    velocity: Array  # (N, 6)
    turn: Array  # (N, 3) angular velocity, integrated over time
    impulse: Array  # (N, 6) loads other than the fluid's, integrated over time


class Limits(NamedTuple):
    """When a burst must end."""

    sub_step: float  # s
    most: int  # sub-steps
    start: Array  # (N, 3) µm, centres when the coupling was frozen
    pairs: Indices  # (P, 2)
    pair_move: Array  # (P,) µm, relative displacement allowed
    gap_low: Array  # (N,) µm, bounds within which the frozen coupling may be combined with r(h)
    gap_high: Array  # (N,) µm


class Dice(NamedTuple):
    """What the draws of this burst are keyed by."""

    key: Word
    step: int  # of the burst's first sub-step
