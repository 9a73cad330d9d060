"""Scenes of cells that bind each other, and their bonds put in by hand."""

from typing import Any

import numpy as np
from attrs import evolve
from scipy.spatial.transform import Rotation

from mpad_core.physics.state import BondList
from mpad_core.running.initial import at_rest
from mpad_core.running.layout import Molecules
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene

SHELL = 5.175  # µm, on which molecules lie
KEYS = {"off": 2.0, "on": 84.0, "stiffness": 1e3, "compliance": 4e-5, "length": 0.03, "between": '"slex", "psgl"'}
SCENE = """\
seed = {seed}
solver = "{solver}"
stop = {{ time = "1 s" }}
fluid = {{ viscosity = "1 mPa s" }}
{wall}
{flow}
[kinds.bead]
radius = "5 um"
roughness = "175 nm"
sites = {{ {sites} }}
{cells}
{bonds}
[effects]
thermal = "off"
{more}
"""
BRIDGE = """\
[bonds.bridge]
between = [{between}]
model = {{ name = "bell", off_rate = "{off} 1/s", reactive_compliance = "{compliance} um" }}
on_rate = {{ value = "{on} 1/s" }}
length = "{length} um"
stiffness = "{stiffness} pN/um"
"""
WALL = '[wall]\nroughness = "50 nm"\nsites = { selectin = { layout = "uniform", density = "180 1/um^2" } }\n'
TETHER = """\
[bonds.tether]
between = ["slex", "selectin"]
model = {{ name = "bell", off_rate = "50 1/s", reactive_compliance = "4e-5 um" }}
on_rate = {{ value = "84 1/s", at_density = "180 1/um^2" }}
length = "30 nm"
reach = "overlap"
stiffness = "1e3 pN/um"
"""
REPULSION = '[repulsion]\nstrength = "500 pN um"\ndecay = "565 1/um"\n'
SITES = 'slex = { density = "60 1/um^2" }, psgl = { density = "60 1/um^2" }'


def problem_of(
    places: Any, *, held: Any = (), shear: float = 0.0, wall: str = "", more: str = "", seed: int = 1,
    solver: str = "isolated", sites: str = SITES, bonds: str = BRIDGE, **keys: Any,
) -> Any:  # fmt: skip
    """Make a problem of beads at places (µm)."""
    cells = "".join(
        f'[cells.c{i}]\nkind = "bead"\nx = "{x!r} um"\ny = "{y!r} um"\nheight = "{z!r} um"\n'
        + ("held = true\n" if i in held else "")
        for i, (x, y, z) in enumerate(np.asarray(places, float).tolist())
    )
    flow = f'[flow]\nkind = "shear"\nrate = "{shear!r} 1/s"' if shear else ""
    words = {"cells": cells, "flow": flow, "wall": wall, "more": more, "seed": seed, "solver": solver, "sites": sites}
    return compose(parse_scene(SCENE.format(bonds=bonds.format(**(KEYS | keys)), **words)))


def with_molecules(machine: Any, arms: list[Any], kinds: list[Any]) -> Any:
    """Replace every cell's molecules."""
    first = np.cumsum([0, *map(len, arms)])
    kind = np.concatenate([np.full(len(a), k, np.int64) for a, k in zip(arms, kinds, strict=True)])
    molecules = Molecules(np.ascontiguousarray(np.concatenate(arms)), first, kind, machine.fixed.molecules.owner)
    return evolve(machine, fixed=evolve(machine.fixed, molecules=molecules))


def bonded(machine: Any, pairs: Any, state: Any = None) -> Any:
    """Give a state, that at rest if none is given, with bonds between pairs of molecules (B, 2)."""
    first, (site, ligand) = machine.fixed.molecules.first, np.asarray(pairs, np.int64).T.copy()
    cell, partner = (np.searchsorted(first, s, side="right") - 1 for s in (site, ligand))
    zero = np.zeros(len(site), np.int64)
    bonds = BondList(
        cell=cell, site=site, species=zero, state=zero, partner=partner, ligand=ligand, anchor=np.zeros((len(site), 3))
    )
    return evolve(at_rest(machine) if state is None else state, bonds=bonds)


def matrices_of(state: Any) -> Any:
    """Give rotation matrices (N, 3, 3) by scipy."""
    return np.ascontiguousarray(Rotation.from_quat(state.orientations, scalar_first=True).as_matrix())


def bond_loads(machine: Any, state: Any) -> Any:
    """Give the loads (N, 6) of the bonds between cells, by the formula for linear springs that go slack."""
    species, arm, loads = machine.problem.species[0], machine.fixed.molecules.arm, np.zeros((len(state.centres), 6))
    turns, bonds = matrices_of(state), state.bonds
    for i, j, site, ligand in zip(bonds.cell, bonds.partner, bonds.site, bonds.ligand, strict=True):
        own, other = turns[i] @ arm[site], turns[j] @ arm[ligand]
        along = state.centres[i] + own - state.centres[j] - other
        length = np.linalg.norm(along)
        force = -species.model.stiffness * max(length - species.rest_length, 0.0) * along / length
        loads[i] += np.concatenate([force, np.cross(own, force)])
        loads[j] -= np.concatenate([force, np.cross(other, force)])
    return loads
