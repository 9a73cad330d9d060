"""The state as arrays and back."""

from typing import Any

import attrs
import numpy as np
import pytest

from mpad_core.physics.state import BondList, State, from_arrays, no_bonds, to_arrays


def made(**words: Any) -> State:
    rng = np.random.default_rng(1)
    bonds = BondList(
        cell=np.array([0, 1, 1]), site=np.array([4, 7, 9]), species=np.zeros(3, np.int64),
        state=np.array([0, 1, 0]), partner=np.array([-1, 0, -1]),
        ligand=np.array([-1, 5, 1 << 55]), anchor=rng.normal(size=(3, 3)),
    )  # fmt: skip
    given: dict[str, Any] = {
        "step": 1 << 40, "zero": 17, "time": 0.1 + 0.2, "centres": rng.normal(size=(2, 3)),
        "wall_gaps": rng.normal(size=2), "orientations": rng.normal(size=(2, 4)), "velocities": rng.normal(size=(2, 6)),
        "drift": rng.normal(size=(2, 6)), "mean_loads": rng.normal(size=(2, 6)), "bonds": bonds,
        "clocks": rng.exponential(size=2), "draws": np.array([3.0, 0.0]),
        "bound_since": np.array([np.inf, 0.3]), "bound_at": rng.normal(size=2), "caught_since": np.array([np.inf, 0.4]),
    }  # fmt: skip
    return State(**(given | words))


@pytest.mark.parametrize("guess", [None, np.arange(12.0).reshape(2, 6)])
def test_arrays_hold_the_state(guess: Any) -> None:
    state = made(guess=guess)
    arrays = to_arrays(state)
    assert all(isinstance(value, np.ndarray) for value in arrays.values())
    back = from_arrays(arrays, 2, 10)
    for name in ("centres", "wall_gaps", "orientations", "velocities", "drift", "mean_loads", "bound_since"):
        assert np.array_equal(getattr(back, name), getattr(state, name))
    for name in ("bound_at", "caught_since", "clocks", "draws"):
        assert np.array_equal(getattr(back, name), getattr(state, name))
    assert (back.step, back.zero, back.time) == (1 << 40, 17, 0.1 + 0.2)
    assert all(np.array_equal(getattr(back.bonds, n), getattr(state.bonds, n)) for n in attrs.fields_dict(BondList))
    assert guess is None if back.guess is None else np.array_equal(back.guess, guess)
    assert len(back.events) == 0


def test_other_arrays_are_passed_over() -> None:
    """A checkpoint holds more than the state."""
    arrays = to_arrays(made()) | {"schedule.last_time": np.array(1.0), "ended": np.array("")}
    assert from_arrays(arrays, 2, 10).step == 1 << 40


def test_bond_counts() -> None:
    assert made().bond_counts().tolist() == [2, 2]  # one of the three is between the two cells
    assert made(bonds=no_bonds()).bond_counts().tolist() == [0, 0]
    assert len(no_bonds()) == 0
