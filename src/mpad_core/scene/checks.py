"""Checks of a scene as a whole: names that must exist, and cells that must not overlap.

References are checked on the tables of the file, so that they are reported together with faults of single values;
whatever has the wrong type there is passed over, since it is a fault already.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpad_core.plugins import registry
from mpad_core.plugins.registry import nearest
from mpad_core.scene import conditions
from mpad_core.scene.faults import Fault, Path, WrongError, listed, shown
from mpad_core.scene.parts import try_build
from mpad_core.scene.site_layouts import site_faults
from mpad_core.scene.spec import Cell, Group, Scene
from mpad_core.units import thermal_energy

Tables = dict[str, Any]

_MOST = 20  # faults of one sort; a file may hold thousands


def references(data: Tables) -> Iterator[Fault]:
    """Find what is named but not there, and what must or must not stand together."""
    yield from _bodies(data)
    yield from _bonds(data)
    yield from _flow(data)
    yield from _stop(data)
    yield from _passage(data)


def values(scene: Scene) -> Iterator[Fault]:
    """Find what numbers rule out: cells cut by the wall or by each other, bonds that cannot be made."""
    if scene.flow.kind == "none" and scene.flow.rate > 0:
        yield Fault(("flow", "rate"), 'a flow of kind "none" has no rate; write kind = "shear" beside it')
    yield from _rolling(scene)
    heights = list(_heights(scene))
    yield from heights
    if not heights:
        yield from _overlaps(scene)
    yield from _sites(scene)
    yield from _models(scene)


def _table(data: Tables, *keys: str) -> Tables:
    """Give a table further down; empty where there is none."""
    for key in keys:
        found = data.get(key)
        data = found if isinstance(found, dict) else {}
    return data


def _tables(data: Tables, key: str) -> dict[str, Tables]:
    return {name: table for name, table in _table(data, key).items() if isinstance(table, dict)}


def _known(path: Path, name: Any, known: Tables, what: str) -> Iterator[Fault]:
    """Find a name that is not among those known."""
    if isinstance(name, str) and name not in known:
        hint = nearest(name[:100], known)
        yield Fault(path, f"no {what} {shown(name)} in this scene{hint} (there are: {listed(known)})")


def _bodies(data: Tables) -> Iterator[Fault]:
    if not _table(data, "cells") and not _table(data, "groups"):
        yield Fault(("cells",), "there is no cell; add a table such as [cells.free] with kind and height")
    for family in ("cells", "groups"):
        for name, body in _tables(data, family).items():
            yield from _body((family, name), body, data)
    for name in sorted(set(_table(data, "cells")) & set(_table(data, "groups"))):
        yield Fault(("groups", name), "a cell has this name too; rename one of them")


def _body(path: Path, body: Tables, data: Tables) -> Iterator[Fault]:
    yield from _known((*path, "kind"), body.get("kind"), _table(data, "kinds"), "kind")
    if "height" in body and "overlap" in body:
        yield Fault((*path, "overlap"), "height is given too; leave out one of them")
    if "height" not in body and "overlap" not in body:
        yield Fault(path, 'height or overlap is missing; write height = "6 um" or overlap = "0 nm"')
    if "overlap" in body:
        yield from _reaches((*path, "overlap"), body.get("kind"), data)


def between_cells(data: Tables) -> dict[str, Tables]:
    """Give the bonds whose second site is one of cells and not of the wall."""
    carried, walls = _carried(data), _table(data, "wall", "sites")
    found = {}
    for name, bond in _tables(data, "bonds").items():
        pair = bond.get("between")
        second = pair[1] if isinstance(pair, list) and len(pair) == 2 else None
        if isinstance(second, str) and second in carried and second not in walls:
            found[name] = bond
    return found


def _carried(data: Tables) -> Tables:
    """Give the sites that cells carry."""
    return {site: None for kind in _tables(data, "kinds").values() for site in _table(kind, "sites")}


def _reaches(path: Path, kind: Any, data: Tables) -> Iterator[Fault]:
    """Find an overlap that has no meaning, since no bond tells where its zero is."""
    if "wall" not in data:
        yield Fault(path, "needs a wall; give height instead")
        return
    if not isinstance(kind, str) or kind not in _table(data, "kinds"):
        return
    sites = _table(data, "kinds", kind, "sites")
    inner = between_cells(data)
    between = [bond.get("between") for name, bond in _tables(data, "bonds").items() if name not in inner]
    if not any(isinstance(pair, list) and pair and isinstance(pair[0], str) and pair[0] in sites for pair in between):
        yield Fault(path, f"needs a bond that cells of kind {kind!r} can form; give height instead")


def _bonds(data: Tables) -> Iterator[Fault]:
    inner = between_cells(data)
    if set(_table(data, "bonds")) - set(inner) and "wall" not in data:
        yield Fault(("bonds",), "bonds need a wall; add [wall] with its sites, or leave out the bonds")
        return
    carried, walls = _carried(data), _table(data, "wall", "sites")
    for name, bond in _tables(data, "bonds").items():
        pair = bond.get("between")
        if isinstance(pair, list) and len(pair) == 2:
            path = ("bonds", name, "between")
            yield from _known((*path, 0), pair[0], carried, "site of cells")
            yield from _known((*path, 1), pair[1], carried | walls, "site of the wall")
            if isinstance(pair[1], str) and pair[1] in carried and pair[1] in walls:
                yield Fault((*path, 1), f"{shown(pair[1])} is a site of the wall and one of cells; rename one of them")
        yield from _of_pairs(("bonds", name), bond) if name in inner else _of_wall(("bonds", name), bond)


def _of_pairs(path: Path, bond: Tables) -> Iterator[Fault]:
    if bond.get("reach", "pairs") in ("overlap", "boltzmann_gap"):
        yield Fault((*path, "reach"), 'between cells molecules bind one by one; write "pairs", or leave it out')


def _of_wall(path: Path, bond: Tables) -> Iterator[Fault]:
    on_rate = bond.get("on_rate")
    if isinstance(on_rate, dict) and "at_density" not in on_rate:
        what = "missing (the wall's site density that the on-rate holds for)"
        yield Fault((*path, "on_rate", "at_density"), f'{what}; write at_density = "180 1/um^2"')


def _flow(data: Tables) -> Iterator[Fault]:
    flow = _table(data, "flow")
    if flow.get("kind") == "shear" and "rate" not in flow:
        yield Fault(("flow", "rate"), 'missing (shear rate); write rate = "80 1/s"')


def _stop(data: Tables) -> Iterator[Fault]:
    when = _table(data, "stop").get("when")
    for index, condition in enumerate(when if isinstance(when, list) else ()):
        yield from _known(("stop", "when", index), conditions.cell_of(condition), _table(data, "cells"), "cell")


def _passage(data: Tables) -> Iterator[Fault]:
    passage, cells = _table(data, "passage"), _table(data, "cells")
    yield from _known(("passage", "cell"), passage.get("cell"), cells, "cell")
    past = passage.get("past")
    if isinstance(past, str):
        past = [past]
    for index, name in enumerate(past if isinstance(past, list) else ()):
        yield from _known(("passage", "past", index), name, cells, "cell")
        if name == passage.get("cell"):
            yield Fault(("passage", "past", index), f"cell {shown(name)} cannot pass itself; name other cells")
    if past == []:
        yield Fault(("passage", "past"), "names no cell; name at least one")


def _heights(scene: Scene) -> Iterator[Fault]:
    """Find bodies whose smooth sphere touches the wall."""
    bodies: list[tuple[str, str, Cell | Group]] = [("cells", name, cell) for name, cell in scene.cells.items()]
    bodies += [("groups", name, group) for name, group in scene.groups.items()]
    for family, name, body in bodies if scene.wall else ():
        radius, height = scene.kinds[body.kind].radius, scene.height_of(body)
        if not height > radius:
            key = "height" if body.overlap is None else "overlap"
            yield Fault(
                (family, name, key),
                f"the wall cuts the cell: its centre is at {height:.6g} um, its radius is {radius:.6g} um; raise it",
            )


def _rolling(scene: Scene) -> Iterator[Fault]:
    """Find cells that are to roll before time zero but cannot."""
    for name, cell in scene.cells.items():
        able = cell.binds and not cell.held and scene.bonds_of(cell.kind)
        if cell.start.rolling_alone > 0 and not able:
            path = ("cells", name, "start", "rolling_alone")
            yield Fault(path, "only a cell that is not held and can form bonds rolls; leave it out")


def _overlaps(scene: Scene) -> Iterator[Fault]:
    """Find pairs of cells whose smooth spheres overlap."""
    names = list(scene.cells)
    places = np.array([(cell.x, cell.y, scene.height_of(cell)) for cell in scene.cells.values()]).reshape(-1, 3)
    radii = np.array([scene.kinds[cell.kind].radius for cell in scene.cells.values()])
    found = 0
    for index, name in enumerate(names):
        distances = np.linalg.norm(places[index + 1 :] - places[index], axis=1)
        for near in np.flatnonzero(distances < radii[index + 1 :] + radii[index])[: _MOST - found]:
            other = index + 1 + int(near)
            gap = distances[near] - radii[index] - radii[other]
            message = f"overlaps cell {name!r} by {-gap:.6g} um at the start; move one of them"
            yield Fault(("cells", names[other]), message)
            found += 1
        if found >= _MOST:
            return


def _sites(scene: Scene) -> Iterator[Fault]:
    for name, kind in scene.kinds.items():
        for site, sites in kind.sites.items():
            yield from (fault.under(("kinds", name, "sites", site)) for fault in site_faults(kind, sites))


def _models(scene: Scene) -> Iterator[Fault]:
    """Build each bond model as the run will, to let its validators speak."""
    energy = thermal_energy(scene.fluid.temperature)
    for name, bond in scene.bonds.items():
        try:
            try_build(bond.model, rest_length=bond.length, stiffness=bond.stiffness, kT=energy)
        except WrongError as error:
            yield from (fault.under(("bonds", name, "model")) for fault in error.faults)
        if bond.encounter is not None and hasattr(registry.load("bond", bond.model.name), "factor"):
            what = f"bond model {bond.model.name!r} has an encounter of its own; leave this one out"
            yield Fault(("bonds", name, "encounter"), what)
