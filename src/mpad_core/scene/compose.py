"""From a scene to a problem: names resolved, effects decided, cells placed. After this no name is looked up again."""

import zlib

import attrs
import numpy as np
from attrs import evolve

from mpad_core.arrays import Array, Indices
from mpad_core.interfaces.bonds import BondModel, Encounter
from mpad_core.interfaces.errors import InputError
from mpad_core.interfaces.mobility import MobilitySolver
from mpad_core.interfaces.surface import Surface
from mpad_core.interfaces.values import Configuration, Setting
from mpad_core.physics.asking import blamed
from mpad_core.physics.auto import Auto
from mpad_core.physics.bare import Bare
from mpad_core.physics.layouts.layout import Layout
from mpad_core.physics.layouts.uniform import Uniform
from mpad_core.physics.problem import BondSpecies, CaughtWhen, Effect, Problem, Tolerances
from mpad_core.physics.questions import check_needs
from mpad_core.scene.effects import decide
from mpad_core.scene.site_layouts import layout_of
from mpad_core.scene.spec import Bond, Cell, Group, Scene
from mpad_core.units import thermal_energy

_TRIES = 1000  # for each cell placed at random


def compose(scene: Scene, replicate: int = 0) -> Problem:
    """Make the problem that a scene describes.

    Parameters
    ----------
    scene
        A checked scene.
    replicate
        Which of several runs that differ only in their random numbers: it is added to the scene's seed.

    Raises
    ------
    InputError
        For effects that cannot be had, a solver that cannot treat the scene, cells that do not fit.
    PartError
        If a part fails to load.
    """
    scene = evolve(scene, seed=scene.seed + replicate)
    solver = scene.solver.instance
    effects = decide(scene, solver.traits)
    cells, start = _placed(scene)
    kinds = [scene.kinds[cell.kind] for cell in cells.values()]
    radii = np.array([kind.radius for kind in kinds])
    setting = Setting(
        viscosity=scene.fluid.viscosity, shear_rate=scene.flow.rate if effects["shear"].on else 0.0,
        wall=effects["wall"].on,
    )  # fmt: skip
    if effects["coupling"].on:
        for one in _stands_for(solver):
            check_needs(one.traits, one.name, Configuration(centres=start, radii=radii), setting)
    species = _species(scene) if scene.bonds and scene.effects.bonds != "off" else ()
    sites = _site_densities(scene, cells)
    binds = np.array([cell.binds and effects["bonds"].on for cell in cells.values()])
    partner = _partners(scene, list(cells))
    return Problem(
        names=tuple(cells),
        kinds=tuple(cell.kind for cell in cells.values()),
        radii=radii,
        roughness=np.array([kind.roughness for kind in kinds]),
        held=np.array([cell.held for cell in cells.values()]),
        site_densities=sites * binds[:, None],
        hazard_densities=sites,
        start=start,
        alone_for=np.array([cell.start.rolling_alone if isinstance(cell, Cell) else 0.0 for cell in cells.values()]),
        zero_overlap=np.array([scene.zero_overlap_height(cell.kind) for cell in cells.values()]),
        partner=partner,
        dx_from=start[np.where(partner < 0, np.arange(len(cells)), partner), 0],
        external=_weights(scene, effects["gravity"], cells),
        setting=setting,
        solver=solver,
        coupled=effects["coupling"].on,
        wall_roughness=scene.wall.roughness if scene.wall else -np.inf,
        species=species,
        contact=scene.repulsion.instance if scene.repulsion and effects["repulsion"].on else None,
        tolerances=Tolerances(
            position=scene.accuracy.position, rate=scene.accuracy.rate, euler=scene.accuracy.explicit
        ),
        caught=CaughtWhen(bound_for=scene.record.caught.bound_for, slower_than=scene.record.caught.slower_than),
        seed=scene.seed,
        thermal_energy=thermal_energy(scene.fluid.temperature) if effects["thermal"].on else 0.0,
        effects=tuple(effects.values()),
        site_kinds=_site_names(scene),
        layouts=_layouts(scene, cells),
    )


def _stands_for(solver: MobilitySolver) -> tuple[MobilitySolver, ...]:
    """Give a solver, and those that it has been told to choose from."""
    told = solver.rungs() if isinstance(solver, Auto) and solver.levels else ()
    return (solver, *(rung.solver for rung in told))


def _partners(scene: Scene, names: list[str]) -> Indices:
    """Give the cell that each cell's Δx is measured from; -1 for its own place at the start."""
    partners = [scene.partner_of(name) if name in scene.cells else None for name in names]
    return np.array([-1 if other is None else names.index(other) for other in partners], np.int64)


def _site_names(scene: Scene) -> tuple[str, ...]:
    """Name the sites of cells that take part in bonds, each once."""
    walls = scene.wall.sites if scene.wall else {}
    named = [site for bond in scene.bonds.values() for site in bond.between]
    return tuple(dict.fromkeys(site for site in named if site not in walls))


def _site_densities(scene: Scene, cells: dict[str, Cell | Group]) -> Array:
    names = _site_names(scene)
    densities = np.zeros((len(cells), len(names)))
    for i, cell in enumerate(cells.values()):
        for j, name in enumerate(names):
            site = scene.kinds[cell.kind].sites.get(name)
            densities[i, j] = site.density if site else 0.0
    return densities


def _layouts(scene: Scene, cells: dict[str, Cell | Group]) -> tuple[tuple[Layout, ...], ...]:
    """Give how each cell's sites lie; uniformly where it has none."""
    found = [[scene.kinds[cell.kind].sites.get(name) for name in _site_names(scene)] for cell in cells.values()]
    return tuple(tuple(layout_of(sites) if sites else Uniform() for sites in row) for row in found)


def _species(scene: Scene) -> tuple[BondSpecies, ...]:
    kT, sites = thermal_energy(scene.fluid.temperature), _site_names(scene)
    made = []
    for name, bond in scene.bonds.items():
        model = bond.model.build(rest_length=bond.length, stiffness=bond.stiffness, kT=kT)
        made.append(
            BondSpecies(
                name=name,
                site_kind=sites.index(bond.between[0]),
                model=model,
                surface=_surface(scene, bond),
                rest_length=bond.length,
                on_rate=bond.on_rate.value,
                at_density=bond.on_rate.at_density or 1.0,  # without one, molecules are told apart
                reach=bond.reach,
                compression=bond.compression,
                kT=kT,
                encounter=_encounter(bond, model),
                partner_kind=sites.index(bond.between[1]) if scene.between_cells(bond) else -1,
            )
        )
    return tuple(made)


def _surface(scene: Scene, bond: Bond) -> Surface:
    if scene.wall is None or scene.between_cells(bond):
        return Bare()
    part = scene.wall.sites[bond.between[1]]
    with blamed(f"surface {part.name!r}"):  # a file of its own may have changed since the scene was read
        surface: Surface = part.instance
    return surface


def _encounter(bond: Bond, model: BondModel) -> Encounter | None:
    """Give the scene's encounter, or the model's own, if it has one; the scene has not both."""
    if bond.encounter is None:
        return model if isinstance(model, Encounter) else None
    from mpad_core.physics.encounter import ChangHammer

    return ChangHammer(**attrs.asdict(bond.encounter))


def _weights(scene: Scene, gravity: Effect, cells: dict[str, Cell | Group]) -> Array:
    """Give each cell's weight less its buoyancy (pN) as loads (N, 6)."""
    loads = np.zeros((len(cells), 6))
    if gravity.on:
        for i, cell in enumerate(cells.values()):
            kind = scene.kinds[cell.kind]
            excess = 4 / 3 * np.pi * kind.radius**3 * (kind.density - scene.fluid.density)
            loads[i, :3] = excess * np.array(scene.gravity.acceleration)
    return loads


def _placed(scene: Scene) -> tuple[dict[str, Cell | Group], Array]:
    """Give every cell by name, those of groups numbered, and where each starts (N, 3)."""
    cells: dict[str, Cell | Group] = dict(scene.cells)
    places = [[cell.x, cell.y, scene.height_of(cell)] for cell in scene.cells.values()]
    radii = [scene.kinds[cell.kind].radius for cell in scene.cells.values()]
    for name, group in scene.groups.items():
        seeds = np.random.SeedSequence(scene.seed, spawn_key=(zlib.crc32(name.encode()),))
        draws = np.random.Generator(np.random.Philox(seeds))
        radius, height = scene.kinds[group.kind].radius, scene.height_of(group)
        for number in range(group.number):
            places.append(_free_place(name, group, height, radius, draws, np.array(places), np.array(radii)))
            radii.append(radius)
            cells[f"{name}-{number + 1}"] = group
    return cells, np.array(places, float)


def _free_place(
    name: str, group: Group, height: float, radius: float, draws: np.random.Generator, places: Array, radii: Array
) -> list[float]:
    """Draw a place in the group's rectangle that leaves the smallest gap to every cell placed so far."""
    for _ in range(_TRIES):
        place = [draws.uniform(*group.x), draws.uniform(*group.y), height]
        if not len(places):
            return place
        gaps = np.linalg.norm(places - place, axis=1) - radii - radius
        if gaps.min() > group.minimum_gap:
            return place
    raise InputError(
        f"groups.{name}: no room for {group.number} cells of radius {radius:g} um in its rectangle after {_TRIES} "
        "tries for one of them; enlarge x or y, or lower number or minimum_gap"
    )
