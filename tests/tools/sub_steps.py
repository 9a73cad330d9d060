"""What a sub-step of one group is worked out in, for tests that take single ones."""

from typing import Any

import numpy as np

from mpad_core.running.burst import _work_for
from mpad_core.running.layout import Motion, System, Work


def work_for(group: int, system: System, motion: Motion, turn: Any) -> Work:
    """Give the room, as a burst lays it out."""
    places = motion.centre.copy(), motion.orientation.copy(), motion.turn.copy(), turn.copy()
    work: Work = _work_for(group, system.bodies, system.groups, np.empty(len(turn)), *places)
    return work
