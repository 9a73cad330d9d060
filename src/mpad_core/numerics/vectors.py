"""What compiled loops need to run at the width of the machine: wide registers, aligned rows, roots without division."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core import types
from numba.extending import intrinsic

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled, compiled_within

LINE = 64  # bytes of a cache line and of the widest register: a register that lies across two lines is loaded twice


def _wide_registers(typing: Any) -> tuple[Any, Any]:
    """Let the calling kernel use registers of 512 bits where the processor has them.

    LLVM keeps to 256 bits on processors whose clock once fell with wider ones, which halves the speed of long sums and
    products; numba passes no word on it, hence the mark is set on the function itself. Elsewhere it means nothing.
    """

    def mark(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        marks = builder.function.attributes
        if isinstance(marks, set):
            set.add(marks, '"prefer-vector-width"="512"')  # llvmlite's own `add` knows attributes without values only
        return context.get_dummy_value()

    return types.none(), mark


_marking: Any = intrinsic(_wide_registers)  # numba's own type says that it cannot be called
wide_registers: Callable[[], None] = _marking


@compiled_within
def inverse_root(x: float) -> float:
    """Give 1/√x for x > 0 by products alone, to a unit in the last place or two; NaN stays NaN.

    Half the exponent with its sign changed, which is half the bits read as an integer, is within 3.5 % (the constant:
    Lomont, Fast inverse square root, Purdue University, 2003). With e = 1 - x y² the root is exactly y (1 - e)^(-1/2),
    whose series to e³ leaves 35/128 e⁴: 7e-6, and nothing the second time. Division and root take some forty cycles
    for a register of eight numbers, in which the processor could do eighty products.
    """
    y = np.uint64(0x5FE6EB50C7B537A9 - (np.float64(x).view(np.uint64) >> np.uint64(1))).view(np.float64)
    e = 1 - x * y * y
    y += y * e * (1 / 2 + e * (3 / 8 + e * (5 / 16)))
    e = 1 - x * y * y
    return y + y * e * (1 / 2 + e * (3 / 8 + e * (5 / 16)))


@compiled
def aligned_zeros(rows: int, columns: int) -> Array:
    """Give zeros (rows, columns) that start on a cache line."""
    store = np.zeros(rows * columns + LINE // 8)
    skip = -store.ctypes.data % LINE // 8
    return store[skip : skip + rows * columns].reshape(rows, columns)
