"""When a scene's runs end before their time."""

from mpad_core.running.stopping import StopWhen
from mpad_core.scene.spec import Scene


def stop_conditions(scene: Scene) -> list[StopWhen]:
    """Give the scene's conditions, the first of which ends a run."""
    return [
        StopWhen(cell=c.cell, quantity=c.quantity, above=c.op == ">", value=c.value, text=str(c))
        for c in scene.stop.when
    ]
