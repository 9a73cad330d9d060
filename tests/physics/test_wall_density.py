"""The wall's density around cells: what compiled code looks up is what the surface says, at the lattice's middles."""

from typing import Any, ClassVar

import numpy as np
import pytest
from attrs import evolve, frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import InputError, PartError
from mpad_core.interfaces.surface import Surface
from mpad_core.numerics.compiled import compiled
from mpad_core.physics.measures import hazards
from mpad_core.physics.wall_density import AHEAD, STEP, UNTOLD, contact_half_width, densities, rasters
from mpad_core.plugins.registry import load
from mpad_core.running.densities import density_at
from mpad_core.running.densities import holds as windows_hold
from mpad_core.running.layout import Binding

REACH = np.array([0.031])


@frozen(kw_only=True)
class Wavy:
    """Varies everywhere, in no simple way; does not say how finely unless it inherits that."""

    name: ClassVar[str] = "wavy"

    def density(self, x: Array, y: Array) -> Array:
        return 90.0 * (1 + np.sin(1.7 * x) * np.cos(2.3 * y + 0.1 * x))

    def densest(self) -> float:
        return 180.0


@frozen(kw_only=True)
class Resolved(Wavy):
    spacing: float = 0.02

    def resolution(self) -> float:
        return self.spacing


class Faulty(Wavy):
    fault: str = ""

    def density(self, x: Array, y: Array) -> Array:
        found = super().density(x, y)
        return {"negative": found - 1.0, "above": found * 1.1, "nan": found * np.nan, "shape": found[0]}[self.fault]


def on(problem: Any, species: Any, surface: Surface, centres: Any, **words: Any) -> Any:
    """A problem of cells at centres with bonds to a surface."""
    return problem(centres, species=(evolve(species("bell"), surface=surface, **words),))


def holds(found: Any, cell: int, x: float, y: float) -> bool:
    """Tell whether a cell's windows hold all; nothing else of what binds matters."""
    return windows_hold(Binding(*[found if name == "densities" else 0.0 for name in Binding._fields]), cell, x, y)


@compiled
def looked_up(densities: Any, cell: int, kind: int, x: Array, y: Array, out: Array) -> None:
    for n in range(len(x)):
        out[n] = density_at(densities, cell, kind, x[n], y[n])


def look(found: Any, cell: int, x: Array, y: Array, kind: int = 0) -> Array:
    out = np.empty(len(x))
    looked_up(found, cell, kind, x, y, out)
    return out


def around(centre: Any, half: float = 2.0, number: int = 400) -> Any:
    """Random places within a square around a centre."""
    return np.array(centre)[:2, None] + np.random.default_rng(1).uniform(-half, half, (2, number))


CENTRES = [[0.0, 0.0, 5.24], [-30.01, 17.3, 5.24], [81234.567, -4000.2, 5.24]]


@pytest.mark.parametrize("surface", [Wavy(), Resolved(), Resolved(spacing=0.31)], ids=repr)
def test_looks_up_the_surface_at_the_middle_of_the_square(problem: Any, species: Any, surface: Any) -> None:
    asked = on(problem, species, surface, CENTRES, at_density=60.0)
    found = densities(asked, REACH, asked.start)
    spacing = getattr(surface, "spacing", UNTOLD)
    assert found.spacing == pytest.approx([spacing])
    for cell, centre in enumerate(CENTRES):
        x, y = around(centre)
        middle = [(np.floor(places / spacing) + 0.5) * spacing for places in (x, y)]
        assert look(found, cell, x, y) == pytest.approx(surface.density(*middle) / 60.0, rel=1e-9, abs=1e-12)
        assert (look(found, cell, *middle) == look(found, cell, x, y)).all()


def test_a_uniform_wall_is_one_number(problem: Any, species: Any) -> None:
    """The very bits of density by reference, wherever; and no window to leave."""
    asked = problem(CENTRES, species=(species("bell", density=170.0), species("ideal", density=7.1, at_density=9.7)))
    found = densities(asked, np.array([0.031, 0.05]), asked.start)
    assert (found.size == 1).all()
    x, y = np.random.default_rng(1).uniform(-1e5, 1e5, (2, 50))
    assert (look(found, 1, x, y) == 170.0 / 180.0).all()
    assert (look(found, 2, x, y, kind=1) == 7.1 / 9.7).all()
    assert holds(found, 0, 1e6, -1e6)


def test_edges_are_right_to_half_a_spacing(problem: Any, species: Any) -> None:
    surface = load("surface", "pattern")(kind="stripes", high=180.0, period=1.37, angle=33.0)
    asked = on(problem, species, surface, CENTRES[:1])
    x, y = around(CENTRES[0], number=20_000)
    wrong = look(densities(asked, REACH, asked.start), 0, x, y) != surface.density(x, y) / 180.0
    along = (x * np.cos(np.deg2rad(33)) + y * np.sin(np.deg2rad(33))) / (0.5 * 1.37)
    to_edge = np.abs(along - np.round(along)) * 0.5 * 1.37
    assert wrong.any()
    assert to_edge[wrong].max() <= surface.resolution() * np.sqrt(0.5)  # half a square's diagonal


def test_windows_follow_the_cells_and_change_nothing(problem: Any, species: Any) -> None:
    """With windows kept, with windows made anew, with windows of cells elsewhere: the same value at the same place."""
    asked = on(problem, species, Resolved(), CENTRES)
    kept = rasters(asked, REACH)
    moving, windows = asked.start.copy(), set()
    for _ in range(40):
        moving[:, :2] += [0.21, -0.13]
        now, anew = kept.at(moving), densities(asked, REACH, moving)
        for field in now._fields:
            assert (getattr(now, field) == getattr(anew, field)).all(), field
        windows.add((int(now.first_i[0, 0]), int(now.first_j[0, 0])))
        assert all(holds(now, cell, *moving[cell, :2]) for cell in range(3))
    assert 12 <= len(windows) <= 26  # 8.4 µm and 5.2 µm in steps of 0.6 µm
    x, y = around([0.5, 0.5], half=1.0)
    first, second = (densities(asked, REACH, np.array([c] * 3, float)) for c in ([0, 0, 5.2], [1.3, 0.9, 5.2]))
    assert first.first_i[0, 0] != second.first_i[0, 0]
    assert (look(first, 0, x, y) == look(second, 0, x, y)).all()


def test_a_cell_that_stays_is_not_sampled_again(problem: Any, species: Any) -> None:
    asked_for: list[int] = []

    @frozen(kw_only=True)
    class Counting(Wavy):
        def density(self, x: Array, y: Array) -> Array:
            asked_for.append(np.broadcast(x, y).size)
            return super().density(x, y)

    asked = on(problem, species, Counting(), [[0.3, 0.3, 5.24], [20.3, 0.3, 5.24]])
    kept = rasters(asked, REACH)
    kept.at(asked.start)
    kept.at(asked.start + 0.01)
    assert len(asked_for) == 2
    kept.at(asked.start + np.array([[0.0, 0, 0], [STEP, 0, 0]]))
    assert len(asked_for) == 3
    assert asked_for[0] == kept.current.size[0, 0] ** 2


@pytest.mark.parametrize("spacing", [0.011, 0.05, 0.7, 5.0])
@pytest.mark.parametrize("reading", ["overlap", "pairs"])
def test_a_cell_has_room_ahead_and_then_leaves(problem: Any, species: Any, spacing: float, reading: str) -> None:
    asked = on(problem, species, Resolved(spacing=spacing), CENTRES, reach=reading)
    random = np.random.default_rng(4)
    for _ in range(20):
        centres = asked.start + random.uniform(-3, 3, (3, 1))
        found = densities(asked, REACH, centres)
        for cell in range(3):
            x, y = centres[cell, :2]
            heading = random.uniform(0, 2 * np.pi)
            ahead = np.array([np.cos(heading), np.sin(heading)])
            assert holds(found, cell, *(centres[cell, :2] + 0.999 * AHEAD * ahead))
            assert not holds(found, cell, x + AHEAD + 2 * STEP + 4 * spacing, y)
            assert not holds(found, cell, x, y - AHEAD - 2 * STEP - 4 * spacing)


def test_what_is_held_is_what_molecules_reach(problem: Any, species: Any) -> None:
    """By brute force over the shell of a cell that lies on the wall with its smooth sphere: as low as it can be."""
    asked = on(problem, species, Wavy(), [[0, 0, 5.0]])
    cosine = np.cos(np.linspace(0, np.pi, 2_000_001))
    shell, tips = 5.175, 0.05
    in_reach = 5.0 - shell * cosine - tips < REACH[0]
    farthest = shell * np.sqrt(1 - cosine[in_reach] ** 2).max()
    width = contact_half_width(asked, asked.species[0], REACH[0])[0]
    assert width == pytest.approx(farthest, abs=1e-4)
    assert contact_half_width(asked, evolve(asked.species[0], reach="pairs"), REACH[0])[0] == width + REACH[0]


def test_cells_without_such_molecules_have_no_window(problem: Any, species: Any) -> None:
    asked = on(problem, species, Wavy(), CENTRES[:2])
    asked = evolve(asked, site_densities=np.array([[90.0], [0.0]]))
    found = densities(asked, REACH, asked.start)
    assert found.size[0, 0] > 1
    assert (found.size[1, 0], look(found, 1, np.zeros(1), np.zeros(1))[0]) == (1, 0.0)
    assert holds(found, 1, 1e6, 0.0)


def test_single_molecules_count_by_the_densest_place(problem: Any, species: Any) -> None:
    asked = on(problem, species, Wavy(), CENTRES[:1], reach="pairs", at_density=60.0)
    found = densities(asked, REACH, asked.start)
    x, y = around(CENTRES[0], half=0.5)
    middle = [(np.floor(places / UNTOLD) + 0.5) * UNTOLD for places in (x, y)]
    assert look(found, 0, x, y) == pytest.approx(Wavy().density(*middle) / 180.0)
    bare = on(problem, species, load("surface", "uniform")(density=0.0), CENTRES[:1], reach="pairs")
    assert look(densities(bare, REACH, bare.start), 0, x, y).max() == 0


def test_no_species_no_density(problem: Any) -> None:
    asked = problem(CENTRES)
    found = densities(asked, np.zeros(0), asked.start)
    assert found.value.shape == (0,)
    assert found.size.shape == (3, 0)
    assert holds(found, 0, 1e3, 1e3)


@pytest.mark.parametrize("fault", ["negative", "above", "nan", "shape"])
def test_a_surface_that_says_nonsense_is_named(problem: Any, species: Any, fault: str) -> None:
    surface = Faulty()
    object.__setattr__(surface, "fault", fault)
    asked = on(problem, species, surface, CENTRES[:1])
    says = "have shape" if fault == "shape" else "must lie from 0 to its densest"
    with pytest.raises(PartError, match=f"surface 'wavy': densities {says}"):
        densities(asked, REACH, asked.start)


def test_what_varies_too_finely_is_refused(problem: Any, species: Any) -> None:
    fine = on(problem, species, Resolved(spacing=1e-4), CENTRES[:1])
    with pytest.raises(
        InputError, match=r"bond 'tether': surface 'wavy' varies within 0\.0001 um, which takes .* samples"
    ):
        rasters(fine, REACH)
    for spacing in (0.0, -1.0, np.nan):
        with pytest.raises(PartError, match=r"surface 'wavy': resolution\(\) is .*, not a length"):
            rasters(on(problem, species, Resolved(spacing=spacing), CENTRES[:1]), REACH)


@pytest.mark.parametrize("reach", ["overlap", "pairs", "boltzmann_gap"])
@pytest.mark.parametrize("overlap", [-0.02, 0.0])
def test_twice_the_sites_on_the_wall_bind_twice_as_fast(problem: Any, species: Any, reach: str, overlap: float) -> None:
    """The rate of a first bond, whichever sites can bind, on a bare, a sparse and a dense half of one wall."""
    halves = load("surface", "pattern")(kind="stripes", high=120.0, low=60.0, period=100.0)
    bare = load("surface", "pattern")(kind="stripes", high=120.0, period=100.0)
    places = np.array([[25.0, 0, 5.255 + overlap], [75.0, 0, 5.255 + overlap]])
    made = species("ideal", reach=reach)
    rate, other = (
        hazards(problem(places, species=(evolve(made, surface=surface),))).at(places) for surface in (halves, bare)
    )
    assert rate[0] > 0
    assert rate[0] == pytest.approx(2 * rate[1], rel=1e-12)
    assert other.tolist() == [rate[0], 0.0]
    assert rate[1] == pytest.approx(hazards(problem(places, species=(species("ideal", reach=reach, density=60.0),)))
                                    .at(places)[1], rel=1e-12)  # fmt: skip
