"""The data of the burst: named tuples of arrays, which compiled code takes as they are.

Where the scene has no bonds, no repulsion or no thermal motion, an `Absent` stands for their data: the burst is then
compiled without them. What else may be missing is a table or list of length zero; the code never asks.
"""

from typing import NamedTuple

from mpad_core.arrays import Array, Flags, Indices
from mpad_core.numerics.streams import Word
from mpad_core.numerics.tables import Tables
from mpad_core.physics.wall_density import Densities


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
    """The kinds of bond; K of them, each with one inner state or more."""

    tables: Tables  # of one inner state each; columns: tension (pN), off-rate, on-rate, rates of exchange (1/s)
    first: Indices  # (K + 1,) each kind's first table: that of inner state 0
    site_kind: Indices  # (K,) which kind of site on the cell takes part
    partner_kind: Indices  # (K,) and which on the other cell; -1: the wall's
    reach: Array  # (K,) µm, tip gap, or distance of two molecules, beyond which no bond forms
    slack_below: Array  # (K,) µm, length below which a bond does not pull, nor push
    least_length: Array  # (K,) µm, length that a bond is at least born with (tilted if need be)
    pairwise: Flags  # (K,) whether the wall's molecules are told apart
    ligand_density: Array  # (K,) 1/µm², densest of the wall's molecules that are told apart
    encounters: Tables  # column: factor on the on-rate over slip speed (µm/s)
    encounter: Indices  # (K,) which of them; -1 for a kind whose on-rate does not depend on slip


class Bonds(NamedTuple):
    """Living bonds, each with the cell that keeps it; a cell's stand together, oldest first."""

    first: Indices  # (N + 1,) each cell's first place; its room ends at the next cell's
    number: Indices  # (N,) of living bonds
    site: Indices  # (B,) index into Molecules
    species: Indices  # (B,)
    state: Indices  # (B,) inner state
    partner: Indices  # (B,) the other cell; -1 for the wall
    ligand: Indices  # (B,) the other molecule: index into Molecules, or the wall's identity; -1 where not told apart
    anchor: Array  # (B, 3) µm, where the bond holds the wall; not used between cells
    bridges: Indices  # (N,) how many of each cell's bonds are to other cells
    bridge: Indices  # (B,) which, from the cell's first place on


class Contacts(NamedTuple):
    """Repulsion between roughness layers."""

    law: Tables  # one table; column: force (pN) over tip gap (µm)
    reach: float  # µm, tip gap beyond which there is no force
    pairs: Indices  # (P, 2) cells that may come into contact during the burst, in the order of the first one's group
    pair_first: Indices  # (groups + 1,) each group's first pair


class Neighbours(NamedTuple):
    """Pairs of cells that may come to bind to each other during a burst; each has a keeper, which is not held."""

    first: Indices  # (N + 1,) each keeper's first pair
    partner: Indices  # (P,) the other cell


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

    energy: float  # kT, pN µm
    owner: Indices  # (N,) each cell's identity in draws, as in Molecules


class Bench(NamedTuple):
    """What rates and loads of bonds are worked out in, one cell or pair of cells after the other."""

    factor: Array  # (K,) on on-rates
    levers: Array  # (2, 3, 6) and (3, 3): of a bond between cells
    ends: Array
    middle: Array  # (N, 3) and (N, 3, 3): places and turns of cells on their way
    middle_turn: Array


class Binding(NamedTuple):
    """What may bind to what."""

    shell: Array  # (N,) µm, radius on which a cell's molecules lie
    wall_tips: float  # µm, height of the wall's molecules
    molecules: Molecules
    species: Species
    neighbours: Neighbours
    densities: Densities  # of the wall's sites around each cell, by the one that the on-rate is given at
    bench: Bench


class System(NamedTuple):
    """All that a burst reads and does not change; the last three may be absent."""

    bodies: Bodies
    groups: Groups
    contacts: Contacts
    thermal: Thermal
    binding: Binding


class Motion(NamedTuple):
    """What the burst changes."""

    centre: Array  # (N, 3) µm
    gap: Array  # (N,) µm, smooth sphere to wall
    orientation: Array  # (N, 4)
    velocity: Array  # (N, 6)
    turn: Array  # (N, 3) angular velocity, integrated over time
    impulse: Array  # (N, 6) loads other than the fluid's, integrated over time


class Work(NamedTuple):
    """What the sub-steps of one group of n cells are worked out in, and where the one being tried ends; m = 6n."""

    radius: Array  # (n,) µm
    matrix: Array  # (m, m) r + C
    stiffness: Array  # (m, m)
    right: Array  # (m,) f + k + g
    load: Array  # (m,) all other loads
    velocity: Array  # (m,)
    residual: Array  # (m,)
    change: Array  # (m,)
    moved: Array  # (m,)
    noise: Array  # (m,) s^½, increments of the Brownian paths
    functions: Array  # (8,) of the wall
    push: Array  # (m,) and (m,): of thermal motion
    star: Array
    gaps: Array  # (N,) µm; the rest as in Motion, for all cells
    centre: Array  # (N, 3)
    orientation: Array  # (N, 4)
    rotation: Array  # (N, 3) as motion.turn
    turn: Array  # (N, 3, 3) rotation matrices


class Places(NamedTuple):
    """Where all cells are."""

    centre: Array  # (N, 3) µm
    rotation: Array  # (N, 3) angular velocity, integrated over time since the burst began
    turn: Array  # (N, 3, 3) rotation matrices


class Clocks(NamedTuple):
    """Each cell's clock of events: the next one happens when the hazard integrated since the last has used it up."""

    left: Array  # (N,) of a random number that is exponential with mean one
    number: Indices  # (N,) of numbers drawn so far, by which the next ones are keyed
    owner: Indices  # (N,) each cell's identity in draws, as in Molecules


class Progress(NamedTuple):
    """How far a burst has come; it may leave to be given more room and go on."""

    beats: Indices  # (1,) whole sub-steps done
    tick: Indices  # (groups + N,) how far each group, and each held cell, has come in the sub-step that is under way
    part: Indices  # (groups + N,) how long, in ticks, the next part of its way is to be
    events: Indices  # (1,) how many stand in the table
    trail: Indices  # (1,) how many places of the way have been noted


class Trail(NamedTuple):
    """The way of the cells through a burst, noted at the end of every few sub-steps; room for W."""

    every: int  # sub-steps
    step: Indices  # (W,) sub-steps done
    centre: Array  # (W, N, 3) µm
    gap: Array  # (W, N)
    orientation: Array  # (W, N, 4)
    turn: Array  # (W, N, 3)


class Limits(NamedTuple):
    """When a burst must end."""

    sub_step: float  # s
    most: int  # sub-steps
    error: float  # µm, of a cell's surface over the part of a sub-step that it moves at once; absent for explicit steps
    rate: float  # relative, of the rates of events
    euler: float  # s, step of the explicit scheme; absent for the implicit one
    start: Array  # (N, 3) µm, centres when the coupling was frozen
    pairs: Indices  # (P, 2)
    pair_move: Array  # (P,) µm, relative displacement allowed
    gap_low: Array  # (N,) µm, bounds within which the frozen coupling may be combined with r(h)
    gap_high: Array  # (N,) µm


class Dice(NamedTuple):
    """What the draws of this burst are keyed by."""

    key: Word
    step: int  # at which the burst begins
    stride: int  # from one sub-step to the next


class Candidates(NamedTuple):
    """What may bind to what: molecules of each cell near the wall, or near another cell, and how long they stand."""

    first: Indices  # (N + 1,) each cell's first place; its room ends at the next cell's
    number: Indices  # (N,)
    site: Indices  # (C,)
    species: Indices  # (C,)
    ligand: Indices  # (C,) as in Bonds
    partner: Indices  # (C,)
    x: Array  # (C,) µm, of the wall's molecule, where they are told apart
    y: Array  # (C,)
    near_first: Indices  # (N + 1,) as first, for the molecules that are only near
    near_number: Indices  # (N,)
    near: Indices  # (S,) sites
    slack: Array  # (N, 3) µm, how much nearer molecules may come before candidates, or near ones, must be listed anew
    lever: Array  # (N, 3) µm, how far from the axis of the cell's turn the first to come would be
    centre: Array  # (N, 3, 3) µm, of the cell when they were listed
    turn: Array  # (N, 3, 3) motion.turn at that time; in the third rows, all of it if candidates were listed now
    facing_first: Indices  # (2P + 1,) of the molecules of a pair's keeper, and of its partner, that face the other
    facing_number: Indices  # (2P,); a first one below zero: not listed yet
    facing: Indices  # (F,) sites
    pair_slack: Array  # (P, 3) as slack
    pair_from: Array  # (P, 3, 9) relative place and both turns at that time


class Adhesion(NamedTuple):
    """The bonds, and what may happen to them."""

    bonds: Bonds
    bound: Flags  # (S,) whether each molecule is bound
    listed: Candidates
    clocks: Clocks
    ahead: Array  # (N, 2) 1/s, each cell's rates on the way that is being tried
    events: Array  # of BOND_EVENT


class Course(NamedTuple):
    """All that a burst has to do with; the last may be absent, with the system's `Binding`."""

    system: System
    limits: Limits
    dice: Dice
    motion: Motion
    turn: Array  # (N, 3, 3) the cells' rotation matrices
    progress: Progress
    trail: Trail
    adhesion: Adhesion
