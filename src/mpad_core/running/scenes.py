"""The march of a scene, as a generator of states."""

from collections.abc import Iterator

from mpad_core.physics.state import State
from mpad_core.running.choosing import settled
from mpad_core.running.initial import initial_state
from mpad_core.running.march import make_ready, march
from mpad_core.scene.compose import compose
from mpad_core.scene.spec import Scene


def states(scene: Scene, *, replicate: int = 0) -> Iterator[State]:
    """Yield the state after each outer step, that of time zero first, until the scene's time is over.

    The scene's stop conditions are the listener's business: leave the loop when you have seen enough.

    Parameters
    ----------
    scene
        See `mpad_core.load_scene`.
    replicate
        Added to the scene's seed.
    """
    problem = compose(settled(scene), replicate)
    machine = make_ready(problem)
    yield from march(machine, initial_state(machine), scene.stop.time)
