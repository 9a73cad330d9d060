"""A small laboratory: scenes from a few words, machines with chosen steps, bonds put in by hand."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from mpad_core.arrays import Array
from mpad_core.physics.problem import Problem
from mpad_core.physics.state import BondList, State
from mpad_core.running.initial import at_rest, initial_state
from mpad_core.running.layout import Molecules
from mpad_core.running.march import Machine, make_ready, march
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene
from mpad_core.scene.spec import Scene

_BOND = """
[bonds.tether]
between = ["slex", "selectin"]
model = {{ name = "bell", off_rate = "{off_rate} 1/s", reactive_compliance = "{compliance} um" }}
on_rate = {{ value = "{on_rate} 1/s", at_density = "180 1/um^2" }}
length = "{length} um"
stiffness = "{stiffness} pN/um"
reach = "{reach}"
compression = "{compression}"
"""
_BOND_DEFAULTS: dict[str, Any] = {
    "off_rate": 2.0,
    "compliance": 4e-5,
    "on_rate": 84.0,
    "length": 0.03,
    "stiffness": 1e5,
    "reach": "overlap",
    "compression": "slack",
}


def _text(
    cells: dict[str, str], *, solver: str = "isolated", shear: float = 0.0, excess: float = 0.0, wall: bool = True,
    bond: dict[str, Any] | None = None, repulsion: bool = False, position: float = 1e-4, rate: float = 1e-3,
    sites: float = 90.0, wall_sites: float = 180.0, seed: int = 1, stop: str = 'time = "1 s"', more: str = "",
    thermal: str = "off",
) -> str:  # fmt: skip
    """Write a scene of beads of 5 µm; `excess` (kg/m³) makes them heavier than water, each cell is its keys in TOML."""
    lines = [
        f'seed = {seed}\nsolver = "{solver}"\nstop = {{ {stop} }}',
        f'accuracy = {{ position = "{position!r} um", rate = {rate!r} }}',
        '[fluid]\nviscosity = "1 mPa s"\ndensity = "1000 kg/m^3"',
        f'[flow]\nkind = "shear"\nrate = "{shear!r} 1/s"' if shear else "",
        '[gravity]\nacceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]' if excess else "",
        '[wall]\nroughness = "50 nm"' if wall else "",
        f'sites = {{ selectin = {{ layout = "uniform", density = "{wall_sites!r} 1/um^2" }} }}'
        if wall and bond is not None
        else "",
        f'[kinds.bead]\nradius = "5 um"\nroughness = "175 nm"\ndensity = "{1000 + excess!r} kg/m^3"',
        f'sites = {{ slex = {{ density = "{sites!r} 1/um^2" }} }}' if bond is not None else "",
        *(f'[cells.{name}]\nkind = "bead"\n{keys}' for name, keys in cells.items()),
        _BOND.format(**(_BOND_DEFAULTS | bond)) if bond is not None else "",
        '[repulsion]\nstrength = "500 pN um"\ndecay = "565 1/um"' if repulsion else "",
        f'[effects]\nthermal = "{thermal}"',
        more,
    ]
    return "\n".join(line for line in lines if line)


class Lab:
    """What the tests of this folder share."""

    def scene(self, cells: dict[str, str], **words: Any) -> Scene:
        return parse_scene(_text(cells, **words))

    def problem(self, cells: dict[str, str], **words: Any) -> Problem:
        return compose(self.scene(cells, **words))

    def machine(self, cells: dict[str, str], **words: Any) -> Machine:
        return make_ready(self.problem(cells, **words))

    def ready(self, problem: Problem, **pace: Any) -> Machine:
        """Make a machine with steps other than those it would choose."""
        machine = make_ready(problem)
        return evolve(machine, pace=evolve(machine.pace, **pace))

    def many(self, problem: Problem, number: int) -> Problem:
        """Give a problem of one cell so many times, 30 µm apart, without molecules; each has draws of its own."""
        copies = problem.only([0] * number)
        apart = np.outer(np.arange(number), [0.0, 30.0, 0.0])
        names = tuple(f"c{i}" for i in range(number))
        none = 0.0 * copies.site_densities  # they are to be put in by hand, and to place 28 000 a cell takes long
        return evolve(copies, names=names, start=copies.start + apart, site_densities=none)

    def start(self, machine: Machine) -> State:
        return initial_state(machine)

    def states(self, machine: Machine, until: float, state: State | None = None) -> list[State]:
        return list(march(machine, at_rest(machine) if state is None else state, until))

    def last(self, machine: Machine, until: float, state: State | None = None) -> State:
        reached = at_rest(machine) if state is None else state
        for following in march(machine, reached, until):
            reached = following
        return reached

    def with_molecules(self, machine: Machine, arms: list[Array]) -> Machine:
        """Replace every cell's molecules by these (µm, in the cell's frame), all of the first kind."""
        arm = np.ascontiguousarray(np.concatenate([np.zeros((0, 3)), *arms]))
        first = np.cumsum([0, *(len(a) for a in arms)])
        kind = np.zeros(len(arm), np.int64)
        molecules = Molecules(arm, first, kind, machine.fixed.molecules.owner)
        return evolve(machine, fixed=evolve(machine.fixed, molecules=molecules))

    def bound(self, machine: Machine, sites: Any, anchors: Any) -> State:
        """Give the state at rest with bonds between molecules and places on the wall."""
        site = np.asarray(sites, np.int64)
        cell = np.searchsorted(machine.fixed.molecules.first, site, side="right") - 1
        none = np.full(len(site), -1, np.int64)
        anchor = np.asarray(anchors, float).reshape(-1, 3)
        zero = np.zeros(len(site), np.int64)
        bonds = BondList(cell=cell, site=site, species=zero, state=zero, partner=none, ligand=none, anchor=anchor)
        return evolve(at_rest(machine), bonds=bonds)


@pytest.fixture(scope="session")
def lab() -> Lab:
    return Lab()


@pytest.fixture(scope="session")
def same() -> Callable[[State, State], bool]:
    """Tell whether two states are equal bit for bit, events and the solver's guess left out."""

    def equal(a: State, b: State) -> bool:
        names = ("step", "zero", "time", "centres", "wall_gaps", "orientations", "velocities", "drift", "mean_loads")
        more = ("clocks", "draws", "bound_since", "bound_at", "caught_since", "level", "trust")
        bonds = ("cell", "site", "species", "state", "partner", "ligand", "anchor")
        return all(np.array_equal(getattr(a, n), getattr(b, n)) for n in names + more) and all(
            np.array_equal(getattr(a.bonds, n), getattr(b.bonds, n)) for n in bonds
        )

    return equal
