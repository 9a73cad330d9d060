"""A problem: what a scene asks for, resolved into bodies, laws and parts. It says everything; it computes nothing."""

from typing import Any

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.bonds import BondModel, Encounter
from mpad_core.interfaces.forces import GapForce
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.surface import Surface
from mpad_core.interfaces.values import Setting
from mpad_core.physics.layouts.layout import Layout

LARGEST_GROUP = 8  # cells whose coupling is solved together within a burst, whose cost grows with the cube
_PER_CELL = (
    *("radii", "roughness", "held", "site_densities", "hazard_densities", "start", "alone_for", "zero_overlap"),
    *("external", "dx_from"),
)
Booleans = NDArray[np.bool_]


@frozen(kw_only=True)
class BondSpecies:
    """One kind of bond between a kind of site on cells and the wall, or a kind of site on other cells."""

    name: str
    site_kind: int  # index of the cells' site
    model: BondModel
    surface: Surface  # density of the wall's sites; none for bonds between cells
    rest_length: float  # µm
    on_rate: float  # 1/s, of an unstressed bond; between cells: of one pair of molecules
    at_density: float  # 1/µm², the wall's site density that the on-rate is given for; between cells it means nothing
    reach: str  # overlap, pairs, boltzmann_gap
    compression: str  # slack, linear
    kT: float  # noqa: N815  # pN µm; the field's own symbol
    encounter: Encounter | None = None  # a factor on the on-rate by the speed of slip
    partner_kind: int = -1  # index of the site of other cells that it binds; -1: the wall's


@frozen(kw_only=True)
class Effect:
    """What was decided about one effect, and why."""

    name: str
    on: bool
    why: str


@frozen(kw_only=True)
class Tolerances:
    """How exact the run is to be."""

    position: float  # µm
    rate: float  # relative
    euler: float = 0.0  # s, step of the explicit scheme that is there for comparison; 0: implicit


@frozen(kw_only=True)
class CaughtWhen:
    """When a cell counts as caught."""

    bound_for: float  # s
    slower_than: float  # fraction of the cell's own free-stream speed


@frozen(kw_only=True, eq=False)
class Problem:
    """N cells and all that acts on them."""

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    radii: Array  # (N,) µm
    roughness: Array  # (N,) µm
    held: Booleans  # (N,)
    site_densities: Array  # (N, site kinds) 1/µm² of smooth sphere; zero on cells that do not bind
    hazard_densities: Array  # (N, site kinds) 1/µm²; of probes too
    start: Array  # (N, 3) µm, centres at time zero
    alone_for: Array  # (N,) s, how long each cell first rolls alone
    zero_overlap: Array  # (N,) µm, height at which unstressed bonds just reach the wall; NaN without bonds
    partner: Indices  # (N,) cell that dx is measured from; -1: from a fixed place
    dx_from: Array  # (N,) µm, that place
    external: Array  # (N, 6) pN, pN µm: weight
    setting: Setting
    solver: MobilitySolver
    coupled: bool  # whether the solver's coupling is used; otherwise each cell follows the exact wall functions alone
    wall_roughness: float  # µm, height of the wall's tips; minus infinity where there is no wall to touch
    species: tuple[BondSpecies, ...]
    contact: GapForce | None
    tolerances: Tolerances
    caught: CaughtWhen
    seed: int
    thermal_energy: float = 0.0  # pN µm, kT of the cells' thermal motion; 0 where there is none
    effects: tuple[Effect, ...] = ()
    site_kinds: tuple[str, ...] = field(default=())
    layouts: tuple[tuple[Layout, ...], ...] = field(default=())  # of each cell, for each site kind; none: uniform

    def only(self, cells: Any) -> "Problem":
        """Give the problem of some of the cells, the others taken away."""
        chosen = np.asarray(cells, dtype=np.intp)
        places = {int(old): new for new, old in enumerate(chosen)}
        partner = np.array([places.get(int(self.partner[i]), -1) for i in chosen], np.int64)
        return evolve(
            self,
            names=tuple(self.names[i] for i in chosen),
            kinds=tuple(self.kinds[i] for i in chosen),
            partner=partner,
            layouts=tuple(self.layouts[i] for i in chosen) if self.layouts else (),
            **{name: getattr(self, name)[chosen] for name in _PER_CELL},
        )
