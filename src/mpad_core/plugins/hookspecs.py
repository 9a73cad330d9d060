"""The hooks: factories, each called once for each plugin that is loaded."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    import click

    from mpad_core.interfaces.bonds import BondModel
    from mpad_core.interfaces.forces import GapForce
    from mpad_core.interfaces.mobility import MobilitySolver
    from mpad_core.interfaces.observer import Observer
    from mpad_core.interfaces.surface import Surface

hookspec = pluggy.HookspecMarker("mpad")
hookimpl = pluggy.HookimplMarker("mpad")


class Hooks:
    """Each hook returns parameter classes: frozen attrs classes with a ``name``, instantiated from the scene."""

    @hookspec
    def mpad_mobility_solvers(self) -> "Sequence[type[MobilitySolver]]":  # type: ignore[empty-body]  # a specification, never called
        """Give mobility solvers (entry points ``solver.<name>``)."""

    @hookspec
    def mpad_bond_models(self) -> "Sequence[type[BondModel]]":  # type: ignore[empty-body]  # a specification, never called
        """Give bond models (entry points ``bond.<name>``)."""

    @hookspec
    def mpad_surfaces(self) -> "Sequence[type[Surface]]":  # type: ignore[empty-body]  # a specification, never called
        """Give surfaces (entry points ``surface.<name>``)."""

    @hookspec
    def mpad_force_laws(self) -> "Sequence[type[GapForce]]":  # type: ignore[empty-body]  # a specification, never called
        """Give force laws (entry points ``force.<name>``)."""

    @hookspec
    def mpad_observers(self) -> "Sequence[type[Observer]]":  # type: ignore[empty-body]  # a specification, never called
        """Give observers (entry points ``observer.<name>``)."""

    @hookspec
    def mpad_commands(self) -> "Sequence[click.Command]":  # type: ignore[empty-body]  # a specification, never called
        """Give commands for the command line (entry points ``command.<name>``)."""
