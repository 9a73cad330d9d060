"""What the suite is asked of: installed parts, each with the parameters that it is made with."""

from collections.abc import Iterable, Iterator
from typing import Any

import attrs
from attrs import field, frozen

from mpad_core.interfaces.errors import MpadError
from mpad_core.interfaces.values import SolverTraits
from mpad_core.plugins.registry import find, installed, load
from mpad_core.testing.samples import samples_of, typical

KINDS = ("solver", "bond", "surface", "force")


@frozen(kw_only=True)
class Case:
    """One part with parameters.

    Attributes
    ----------
    kind, name
        As entry points have them.
    parameters
        What it is made with, besides its defaults.
    claimed
        The error that a solver claims for these parameters; None: it claims none.
    """

    kind: str
    name: str
    parameters: dict[str, Any] = field(factory=dict)
    claimed: float | None = None

    @property
    def label(self) -> str:
        """What tables call it."""
        return " ".join([self.name, *(f"{key}={value}" for key, value in self.parameters.items())])

    def made(self) -> Any:
        """Make the part."""
        loaded = load(self.kind, self.name)
        return loaded(**self.parameters) if self.kind == "solver" else typical(loaded, **self.parameters)


@frozen(kw_only=True)
class Chosen:
    """Names of the parts that are asked, by kind; empty: all that are installed."""

    names: dict[str, tuple[str, ...]] = field(factory=dict)

    def of(self, kind: str) -> list[str]:
        """Name the chosen parts of a kind.

        Raises
        ------
        InputError
            For a name that is not installed.
        """
        if not any(self.names.values()):
            return list(dict.fromkeys(part.name for part in installed(kind)))
        return [find(kind, name).name for name in self.names.get(kind, ())]


def cases(kind: str, chosen: Chosen) -> list[Case]:
    """Give the cases of a kind; parts that cannot be loaded have none, see `parts`."""
    found: list[Case] = []
    for name in chosen.of(kind):
        try:
            found += _levels(name) if kind == "solver" else _samples(kind, name)
        except (MpadError, TypeError, ValueError):  # the last two from making a solver with its defaults
            continue
    return found


def parts(chosen: Chosen) -> list[tuple[str, str]]:
    """Give kind and name of each chosen part."""
    return [(kind, name) for kind in KINDS for name in chosen.of(kind)]


def beside(mine: Iterable[Case]) -> Iterator[tuple[Case, Case]]:
    """Give every pair of a case and another one of the solvers that are installed, each pair once."""
    everything, seen = cases("solver", Chosen()), set()
    for case in mine:
        for other in everything:
            pair = frozenset((case.label, other.label))
            if len(pair) == 2 and pair not in seen:
                seen.add(pair)
                yield case, other


def finest() -> Case | None:
    """Give the installed solver of least claimed error that has lubrication: what levels are judged by."""
    certified = [case for case in cases("solver", Chosen()) if _traits(case).lubrication and case.claimed is not None]
    return min(certified, key=lambda case: case.claimed or 0.0, default=None)


def _traits(case: Case) -> SolverTraits:
    traits: SolverTraits = load("solver", case.name).traits
    return traits


def _levels(name: str) -> list[Case]:
    """Give a solver at each of its levels, and as scenes have it by default if no level is that."""
    made, levels = load("solver", name), load("solver", name).traits.levels
    usual = [level for level in levels if not level.reference]  # references would take hours
    found = [Case(kind="solver", name=name, parameters=dict(x.parameters), claimed=x.error) for x in usual]
    if not any(made(**case.parameters) == made() for case in found):
        found.insert(0, Case(kind="solver", name=name))
    return found


def _samples(kind: str, name: str) -> list[Case]:
    return [Case(kind=kind, name=name, parameters=dict(given)) for given in samples_of(load(kind, name))]


def of_scene(part: Any) -> Case:
    """Give the case of a solver as a scene names it."""
    defaults = {each.alias: each.default for each in attrs.fields(load("solver", part.name)) if each.init}
    given = {key: value for key, value in part.parameters.items() if defaults.get(key) != value}
    same = [case for case in _levels(part.name) if case.made() == part.instance]
    return Case(kind="solver", name=part.name, parameters=given, claimed=same[0].claimed if same else None)
