"""Multiparticle adhesive dynamics: cells in shear flow above a wall, caught by bonds, coupled through the fluid.

The public names, grouped; each is imported when first used, so that importing `mpad_core` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpad_core.arrays import Array
    from mpad_core.interfaces.bonds import BondModel, Encounter, Interconverting
    from mpad_core.interfaces.errors import InputError, MpadError, PartError, RefusedError
    from mpad_core.interfaces.forces import GapForce
    from mpad_core.interfaces.mobility import Fluctuating, FluidVelocity, MobilitySolver
    from mpad_core.interfaces.observer import FieldDeclaration, Frame, Observer
    from mpad_core.interfaces.presets import Preset
    from mpad_core.interfaces.surface import Resolving, Surface
    from mpad_core.interfaces.values import AccuracyLevel, Configuration, Motion, Report, Setting, SolverTraits
    from mpad_core.physics.fluid import fluid_velocities
    from mpad_core.physics.questions import mobility_matrix, solver, velocities
    from mpad_core.physics.state import State
    from mpad_core.plugins.hookspecs import hookimpl
    from mpad_core.records.reader import read_trajectory
    from mpad_core.running.scenes import states
    from mpad_core.scene.files import load_scene
    from mpad_core.studies.runs import run
    from mpad_core.units import quantity

_HOMES = {
    "mpad_core.scene.files": ("load_scene",),
    "mpad_core.studies.runs": ("run",),
    "mpad_core.running.scenes": ("states",),
    "mpad_core.records.reader": ("read_trajectory",),
    "mpad_core.physics.questions": ("solver", "mobility_matrix", "velocities"),
    "mpad_core.physics.fluid": ("fluid_velocities",),
    "mpad_core.physics.state": ("State",),
    "mpad_core.plugins.hookspecs": ("hookimpl",),
    "mpad_core.units": ("quantity",),
    "mpad_core.arrays": ("Array",),
    "mpad_core.interfaces.values": (
        *("AccuracyLevel", "Configuration", "Motion", "Report", "Setting", "SolverTraits"),
    ),
    "mpad_core.interfaces.mobility": ("MobilitySolver", "Fluctuating", "FluidVelocity"),
    "mpad_core.interfaces.bonds": ("BondModel", "Interconverting", "Encounter"),
    "mpad_core.interfaces.presets": ("Preset",),
    "mpad_core.interfaces.surface": ("Surface", "Resolving"),
    "mpad_core.interfaces.forces": ("GapForce",),
    "mpad_core.interfaces.observer": ("Observer", "Frame", "FieldDeclaration"),
    "mpad_core.interfaces.errors": ("MpadError", "InputError", "PartError", "RefusedError"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "AccuracyLevel",
    "Array",
    "BondModel",
    "Configuration",
    "Encounter",
    "FieldDeclaration",
    "Fluctuating",
    "FluidVelocity",
    "Frame",
    "GapForce",
    "InputError",
    "Interconverting",
    "MobilitySolver",
    "Motion",
    "MpadError",
    "Observer",
    "PartError",
    "Preset",
    "RefusedError",
    "Report",
    "Resolving",
    "Setting",
    "SolverTraits",
    "State",
    "Surface",
    "fluid_velocities",
    "hookimpl",
    "load_scene",
    "mobility_matrix",
    "quantity",
    "read_trajectory",
    "run",
    "solver",
    "states",
    "velocities",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its home."""
    if name not in _HOME_OF:
        raise AttributeError(f"module 'mpad_core' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
