"""The errors that people see have the exit codes that scripts rely on."""

import pytest

from mpad_core.interfaces import errors
from mpad_core.interfaces.values import Configuration


@pytest.mark.parametrize(("made", "code"), [
    (errors.InputError("a", "b"), 2),
    (errors.PartError("a"), 70),
    (errors.RefusedError("a"), 70),
    (errors.DiskFullError("a"), 74),
    (errors.BusyError("a"), 75),
    (errors.InterruptedRunError("a", 2), 130),
    (errors.InterruptedRunError("a", 15), 143),
])  # fmt: skip
def test_exit_codes(made, code):
    assert isinstance(made, errors.MpadError)
    assert made.exit_code == code


def test_every_fault_of_the_input_has_its_line():
    made = errors.InputError("one", "two")
    assert made.lines == ("one", "two")
    assert str(made) == "one\ntwo"


def test_a_configuration_keeps_the_gap_beside_the_height():
    made = Configuration(centres=[[0, 0, 5.0], [20, 0, 6.0]], radii=[4.0, 5.0], wall_gaps=[1 + 1e-13, 1.0])
    part = made.part([0])
    assert part.wall_gaps[0] == 1 + 1e-13
    assert Configuration(centres=[[0, 0, 5.0]], radii=[4.0]).wall_gaps[0] == 1.0
    assert made.centres.dtype == "f8"
