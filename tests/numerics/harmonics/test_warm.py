"""Guesses are laid out anew for other degrees, and what is no guess is not used."""

import numpy as np
import pytest

from mpad_core.numerics.harmonics.layout import place, places
from mpad_core.numerics.harmonics.pairs import places_of
from mpad_core.numerics.harmonics.warm import between, kept, started

LOW, HIGH = (places_of(np.array(degrees), True) for degrees in ([2, 3], [4, 3]))


def coefficients(at, columns=2):
    return np.random.default_rng(1).normal(size=(columns, at.own[-1]))


def test_a_guess_comes_back_as_it_was():
    y = coefficients(LOW)
    assert (started(kept(LOW, y), 2, LOW) == y).all()


def test_higher_degrees_are_dropped_or_zero():
    y = coefficients(LOW)
    raised = started(kept(LOW, y), 2, HIGH)
    assert (between(HIGH, LOW, raised) == y).all()
    assert np.count_nonzero(raised) == np.count_nonzero(y)
    first = raised[:, : HIGH.own[1]].reshape(2, 6, places(4))
    assert first[:, :, place(2, 1)] == pytest.approx(y[:, : LOW.own[1]].reshape(2, 6, places(2))[:, :, place(2, 1)])
    assert not first[:, :, place(3, 0) :].any()


def useless():
    """Give what a caller might hand over, none of it a guess of two columns for two spheres."""
    good = kept(LOW, coefficients(LOW))
    label, infinite, halves, none = good.copy(), good.copy(), good.copy(), good.copy()
    label[0, 0], infinite[1, 9], halves[0, :2], none[0, :2] = np.nan, np.inf, [2.5, 3.0], [0, 3]
    return {
        "nothing": None,
        "of one column": good[:1],
        "too short": good[:, :-1],
        "flat": good[0],
        "of labels only": good[:, :2],
        "of no degree": label,
        "of half a degree": halves,
        "of degree 0": none,
        "of infinite size": infinite,
    }


@pytest.mark.parametrize("name", useless())
def test_what_is_no_guess_is_not_used(name):
    assert started(useless()[name], 2, LOW) is None
