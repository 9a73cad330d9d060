"""How many spheres fit."""

from mpad_core.interfaces.errors import RefusedError

MOST = 4e9  # bytes
COPIES = 3  # of the operator: without the wall, with it, and eliminated


def refuse_many(number: int, elements: int) -> None:
    """Refuse more spheres than fit in memory.

    Raises
    ------
    RefusedError
        Naming the number, and what would do.
    """
    size = COPIES * 8 * (3 * elements * number) ** 2
    if size > MOST:
        most = int((MOST / (COPIES * 8)) ** 0.5 / (3 * elements))
        raise RefusedError(
            f"cdl-biem: {number} spheres of {elements} elements need {size / 1e9:.3g} GB; {most} spheres would do, "
            "or discretisation = 'spectral'"
        )
