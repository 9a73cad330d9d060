"""Layouts of sites on cells: which keys each of them takes, and how it is made of them."""

import math
from collections.abc import Iterator
from typing import Any

import attrs

from mpad_core.physics.layouts.clusters import Clusters
from mpad_core.physics.layouts.layout import Layout
from mpad_core.physics.layouts.microvilli import Microvilli
from mpad_core.physics.layouts.uniform import Uniform
from mpad_core.scene.faults import Fault, listed
from mpad_core.scene.spec import CellSites, Kind

_LAYOUTS: dict[str, Any] = {"uniform": Uniform, "microvilli": Microvilli, "clusters": Clusters}
_MOST_SITES = 1e8  # binding sites on one cell


def _keys(layout: str) -> list[str]:
    return [field.name for field in attrs.fields(_LAYOUTS[layout])]


def layout_of(sites: CellSites) -> Layout:
    """Make the layout of one kind of site."""
    made: Layout = _LAYOUTS[sites.layout](**{key: getattr(sites, key) for key in _keys(sites.layout)})
    return made


def site_faults(kind: Kind, sites: CellSites) -> Iterator[Fault]:
    """Find keys that the layout lacks or does not know, and numbers of sites or tips that cannot be."""
    number = 4 * math.pi * kind.radius**2 * sites.density
    if number > _MOST_SITES:
        message = f"makes {number:.2g} sites on each cell, the most is {_MOST_SITES:.0g}; lower it"
        yield Fault(("density",), message)
    wrongs = [*_foreign(sites), *_missing(sites)]
    yield from wrongs
    if not wrongs and sites.layout == "microvilli":
        refused = Microvilli(tips=sites.tips, tip_radius=sites.tip_radius).refusal(  # type: ignore[arg-type]
            kind.radius, kind.radius + kind.roughness
        )
        if refused:
            yield Fault(("tips",), f"{refused}; change tips or tip_radius")


def _foreign(sites: CellSites) -> Iterator[Fault]:
    """Find keys that other layouts take."""
    known = _keys(sites.layout)
    for key in {key: None for layout in _LAYOUTS for key in _keys(layout) if key not in known}:
        if getattr(sites, key) is not None:
            what = f"its keys: {listed(known)}" if known else "it takes none but density"
            yield Fault((key,), f"unknown to layout {sites.layout!r} ({what}); leave it out or name another layout")


def _missing(sites: CellSites) -> Iterator[Fault]:
    for key in _keys(sites.layout):
        if getattr(sites, key) is None:
            yield Fault((key,), f"missing; layout {sites.layout!r} needs {listed(_keys(sites.layout))}")
