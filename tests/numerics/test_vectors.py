"""Roots without division, rows on cache lines, and registers as wide as the processor has."""

import numba
import numpy as np
import pytest
from numba.core.registry import cpu_target

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_sums
from mpad_core.numerics.stokeslet_products import sweep_wall
from mpad_core.numerics.vectors import LINE, aligned_zeros, inverse_root


@compiled_sums
def inverse_roots(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(len(x)):
        out[i] = inverse_root(x[i])
    return out


def test_inverse_roots_to_the_last_places() -> None:
    """Over every mantissa's neighbourhood and nearly all exponents; the reference has eleven bits more."""
    rng = np.random.default_rng(3)
    x = np.concatenate(
        [np.linspace(1, 4, 200_001), 10 ** rng.uniform(-300, 300, 200_000), 2.0 ** np.arange(-1000, 1000)]
    )
    exact = 1 / np.sqrt(x.astype(np.longdouble))
    assert (abs(inverse_roots(x) - exact) / exact).max() < 2 * np.finfo(float).eps


def test_inverse_root_of_nan_is_nan() -> None:
    assert np.isnan(inverse_roots(np.array([np.nan]))).all()


@pytest.mark.parametrize("columns", [8, 24, 1152])
def test_rows_start_on_cache_lines(columns: int) -> None:
    rows = aligned_zeros(3, columns)
    assert rows.shape == (3, columns)
    assert not rows.any()
    assert rows.ctypes.data % LINE == 0


def widest() -> str:
    triple, _, features = cpu_target.target_context.codegen().magic_tuple()
    if not triple.startswith("x86_64") or "+fma" not in features:
        pytest.skip("names of registers are those of x86 with fused multiply-adds")
    return "zmm" if "+avx512f" in features else "ymm"


def test_product_runs_in_the_widest_registers() -> None:
    """That the compiler vectorises both loops of the product, and in full width, is half its speed."""
    register = widest()
    kernel = numba.jit(**sweep_wall.targetoptions)(sweep_wall.py_func)  # from the cache there is no assembly to read
    kernel.compile((numba.float64[::1],) * 3)
    assembly = next(iter(kernel.inspect_asm().values()))
    fused = [line for line in assembly.splitlines() if "vfmadd" in line and "pd" in line]
    assert len(fused) > 60  # of two hundred operations for a register of pairs
    assert all(register in line for line in fused)
