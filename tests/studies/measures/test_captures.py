"""Captures: when a cell is caught, and by what."""

import math

import numpy as np
import pytest

from mpad_core.studies.measures.bonds import BOND_LIFE, lives_of
from mpad_core.studies.measures.captures import (
    CaptureRule,
    bound_spans,
    captures,
    caught_spans,
)
from mpad_core.studies.measures.tracks import Track

FORMED, BROKEN = 0, 1
RULE = CaptureRule(bound_for=0.1, slower_than=0.1, within=50.0, shortly=0.1)
NONE = np.empty(0, BOND_LIFE)


def free(time):
    return 200.0


def arriving(name, stops_at, x, y=0.0, span=1.0):
    """Make a cell that comes down the flow at 200 µm/s and stays at x from some time on."""
    times = np.linspace(0, span, 1001)
    return Track(times=times, x=x - 200.0 * np.maximum(stops_at - times, 0), y=np.full(1001, y), name=name, run="r")


class TestCaught:
    def test_from_the_time_on_from_which_it_stays_bound_and_slow(self):
        assert caught_spans(arriving("a", 0.5, 0.0), [(0.5, math.inf)], free, RULE) == [(0.5, math.inf)]

    def test_bound_but_carried_on(self):
        """From 0.35 s on bound, held from 0.5 s on: the first while in which it is slow begins at 0.55 s."""
        (span,) = caught_spans(arriving("a", 0.5, 0.0), [(0.35, 0.9)], free, RULE)
        assert span == (pytest.approx(0.55), 0.9)

    def test_not_bound_for_long_enough(self):
        assert caught_spans(arriving("a", 0.5, 0.0), [(0.5, 0.599), (0.6, 0.699)], free, RULE) == []
        assert caught_spans(arriving("a", 0.5, 0.0), [(0.95, math.inf)], free, RULE) == []

    def test_caught_again(self):
        found = caught_spans(arriving("a", 0.2, 0.0), [(0.2, 0.4), (0.5, 0.8)], free, RULE)
        assert found == [(0.2, 0.4), (0.5, 0.8)]

    def test_without_bonds_it_is_caught_as_long_as_it_is_slow(self):
        """At 200 µm/s to the stop at 0.5 s a while of 0.1 s is slow if it begins within 0.01 s of it."""
        (span,) = caught_spans(arriving("a", 0.5, 0.0), None, free, RULE)
        assert span == (pytest.approx(0.49, abs=0.0015), pytest.approx(1.0))

    def test_spans_of_bonds_with_the_wall(self, events):
        rows = [(0.0, FORMED, 0, 1), (1.0, FORMED, 0, 2), (2.0, BROKEN, 0, 1), (3.0, BROKEN, 0, 2), (4.0, FORMED, 0, 1),
                (0.5, FORMED, 1, 1), (0.2, FORMED, 0, 9, 1), (1.2, FORMED, 0, 3), (1.4, BROKEN, 0, 3)]  # fmt: skip
        lives = lives_of(events(sorted(rows)))
        assert bound_spans(lives, 0) == [(0.0, 3.0), (4.0, math.inf)]
        assert bound_spans(lives, 1) == [(0.5, math.inf)]


class TestClasses:
    def kinds(self, others, lives=NONE, rule=RULE):
        """Give the capture of a cell at x = 0 at 0.5 s beside others that have been caught from the beginning."""
        tracks = [arriving("new", 0.5, 0.0), *(arriving(f"old-{i}", 0.0, x, y) for i, (x, y) in enumerate(others))]
        (found,) = captures(tracks, [[(0.5, math.inf)], *([(0.0, math.inf)] for _ in others)], lives, rule)
        return found

    def test_isolated(self):
        assert self.kinds([]).kind == "isolated"
        assert math.isnan(self.kinds([]).dx)
        alone = self.kinds([(60.0, 0.0)])
        assert (alone.kind, alone.dx, alone.neighbours) == ("isolated", -60.0, 0)

    def test_hydrodynamic(self):
        found = self.kinds([(40.0, -7.5), (-60.0, 0.0)])
        assert (found.kind, found.dx, found.dy, found.neighbours) == ("hydrodynamic", -40.0, 7.5, 1)
        assert (found.cell, found.time, found.run) == ("new", 0.5, "r")

    def test_the_distance_is_that_asked_for(self):
        assert self.kinds([(40.0, 30.0)]).kind == "hydrodynamic"  # just 50 µm
        assert self.kinds([(40.0, 30.1)]).kind == "isolated"

    @pytest.mark.parametrize(("formed", "broken", "kind"), [
        (0.3, 0.45, "cell-cell"), (0.3, math.inf, "cell-cell"), (0.3, 0.39, "hydrodynamic"),
        (0.51, math.inf, "hydrodynamic"),
    ])  # fmt: skip
    @pytest.mark.parametrize("whose", [(0, 1), (1, 0)])
    def test_by_a_cell(self, formed, broken, kind, whose):
        lives = np.zeros(1, BOND_LIFE)
        lives["formed"], lives["broken"], (lives["cell"], lives["partner"]) = formed, broken, whose
        assert self.kinds([(10.0, 0.0)], lives).kind == kind
        assert self.kinds([(10.0, 0.0)], None).kind == "hydrodynamic"
        assert self.kinds([(10.0, 0.0), (-20.0, 0.0)], lives).kind == "multicell"

    def test_of_three_cells(self):
        found = self.kinds([(40.0, 0.0), (-20.0, 0.0)])
        assert (found.kind, found.dx, found.neighbours) == ("multicell", 20.0, 2)

    def test_cells_that_are_free_or_gone_are_no_neighbours(self):
        tracks = [arriving("new", 0.5, 0.0), arriving("free", 0.9, 10.0), arriving("gone", 0.0, 10.0, span=0.3)]
        (one, other) = captures(tracks, [[(0.5, math.inf)], [(0.9, math.inf)], [(0.0, math.inf)]], NONE, RULE)
        assert (one.cell, one.kind) == ("new", "isolated")
        assert (other.cell, other.kind, other.dx) == ("free", "hydrodynamic", 10.0)

    def test_caught_from_the_beginning_is_no_capture(self):
        assert captures([arriving("a", 0.0, 0.0)], [[(0.0, math.inf)]], NONE, RULE) == []
