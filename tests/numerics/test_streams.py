"""Counter-based random numbers: the published answers, fair draws, and independence of order and threads.

Seeds are fixed. Each statistical bound would be broken by true random numbers once in 1e4 tries or less.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from scipy import stats

from mpad_core.numerics.streams import Stream, fill_uniform, key_of, mixed, normal_pair, philox, uniform, uniform_pair

KEY = key_of(7)
KNOWN = [  # kat_vectors of Random123 (Salmon, Moraes, Dror & Shaw 2011), philox4x32-10: counter, key, answer
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]


def words(text: str) -> list[np.uint64]:
    return [np.uint64(int(word, 16)) for word in text.split()]


def draws(number: int, stream: int = 200, identity: int = 3, first: int = 0, key: Any = KEY) -> Any:
    out = np.empty((number, 2))
    fill_uniform(key, stream, np.uint64(identity), first, out)
    return out


def by_identity(number: int, step: int) -> Any:
    return np.array([uniform(KEY, 200, np.uint64(who), step) for who in range(number)])


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN)
def test_philox_gives_the_known_answers(counter: str, key: str, answer: str) -> None:
    low, high = words(key)
    assert [int(word) for word in philox(*words(counter), low | high << np.uint64(32))] == [
        int(word) for word in words(answer)
    ]


def test_uniform_pair_uses_52_bits_of_each_half_of_a_block() -> None:
    who, step, stream = 0x0123456789ABCDEF, 0x00FEDCBA98765432 & (1 << 56) - 1, 201
    last = step >> 32 | stream << 24
    counter = [np.uint64(word) for word in (who & 0xFFFFFFFF, who >> 32, step & 0xFFFFFFFF, last)]
    a, b, c, d = (int(word) for word in philox(*counter, KEY))
    expected = [((x << 32 | y) >> 12) + 0.5 for x, y in ((a, b), (c, d))]
    assert uniform_pair(KEY, stream, np.uint64(who), step) == tuple(value / 2**52 for value in expected)


def test_draws_are_never_zero_or_one() -> None:
    """The extremes of 52 bits, half a step from both ends."""
    assert 0.5 / 2**52 > 0
    assert (2**52 - 0.5) / 2**52 < 1
    assert ((draws(100_000) > 0) & (draws(100_000) < 1)).all()


@pytest.mark.parametrize("column", [0, 1])
def test_draws_are_uniform_over_steps(column: int) -> None:
    assert stats.kstest(draws(200_000)[:, column], "uniform").pvalue > 1e-4


def test_draws_are_uniform_over_identities() -> None:
    assert stats.kstest(by_identity(50_000, 11), "uniform").pvalue > 1e-4


def test_low_bits_are_fair() -> None:
    """The last byte of the 52 bits, where a wrong shift would show."""
    counts = np.bincount((draws(200_000)[:, 0] * 2**52).astype(np.int64) & 255, minlength=256)
    assert stats.chisquare(counts).pvalue > 1e-4


def neighbours() -> dict[str, tuple[Any, Any]]:
    n = 100_000
    base = draws(n)[:, 0]
    return {
        "the pair": (base, draws(n)[:, 1]),
        "the next step": (base[:-1], base[1:]),
        "the next identity": (base, draws(n, identity=4)[:, 0]),
        "another stream": (base, draws(n, stream=201)[:, 0]),
        "the next seed": (base, draws(n, key=key_of(8))[:, 0]),
        "the next replicate": (base, draws(n, key=key_of(7, 1))[:, 0]),
        "2^32 steps later": (base, draws(n, first=1 << 32)[:, 0]),
    }


@pytest.mark.parametrize("which", neighbours())
def test_neighbours_are_independent(which: str) -> None:
    """Correlations of the draws and of their squares have sd 1/√n; 4.5 sd is passed once in 1.5e5 times."""
    a, b = neighbours()[which]
    for f in (lambda u: u, lambda u: (u - 0.5) ** 2):
        assert abs(np.corrcoef(f(a), f(b))[0, 1]) * np.sqrt(len(a)) < 4.5
    grid, _, _ = np.histogram2d(a, b, bins=16, range=[[0, 1], [0, 1]])
    assert stats.chisquare(grid.ravel()).pvalue > 1e-4


def test_order_does_not_matter() -> None:
    whole = draws(1000)
    pieces = [draws(100, first=first) for first in range(900, -100, -100)]
    assert (np.concatenate(pieces[::-1]) == whole).all()
    assert [uniform_pair(KEY, 200, np.uint64(3), step) for step in (999, 0, 500)] == [
        tuple(whole[step]) for step in (999, 0, 500)
    ]
    assert uniform(KEY, 200, np.uint64(3), 17) == whole[17, 0]


def test_threads_do_not_matter() -> None:
    with ThreadPoolExecutor(4) as pool:
        pieces = list(pool.map(lambda first: draws(1000, first=first), range(0, 20_000, 1000)))
    assert (np.concatenate(pieces) == draws(20_000)).all()


def test_streams_are_numbered_once_and_below_those_of_plugins() -> None:
    numbers = [int(stream) for stream in Stream]
    assert len(set(numbers)) == len(Stream.__members__)
    assert max(numbers) < 200


def test_mixed_identities_do_not_collide() -> None:
    """Of 3e5 random 64-bit numbers two agree with a chance of 3e-9."""
    made = {int(mixed(np.uint64(first), np.uint64(second))) for first in range(1000) for second in range(300)}
    assert len(made) == 300_000


def test_mixing_one_bit_changes_half_of_the_bits() -> None:
    """Each flip changes 32 ± 4 bits; the mean over 128 flips has sd 4/√128."""
    first, second = 0x0123456789ABCDEF, 0xFEDCBA9876543210
    base = int(mixed(np.uint64(first), np.uint64(second)))
    changed = [int(mixed(np.uint64(first ^ 1 << bit), np.uint64(second))) ^ base for bit in range(64)]
    changed += [int(mixed(np.uint64(first), np.uint64(second ^ 1 << bit))) ^ base for bit in range(64)]
    assert abs(np.mean([word.bit_count() for word in changed]) - 32) < 4.5 * 4 / np.sqrt(128)
    assert min(word.bit_count() for word in changed) > 8


def test_order_of_mixing_matters() -> None:
    assert mixed(np.uint64(1), np.uint64(2)) != mixed(np.uint64(2), np.uint64(1))


def test_keys_of_seeds_and_replicates_differ() -> None:
    keys = {int(key_of(seed, replicate)) for seed in (0, 1, 2, 1 << 31, 1 << 40) for replicate in range(50)}
    assert len(keys) == 250


def test_a_large_seed_is_not_a_small_one_with_a_replicate() -> None:
    assert key_of(5, 1) != key_of(5 + (1 << 32), 0)


def test_normal_pairs_are_normal_and_independent() -> None:
    pairs = np.array([normal_pair(KEY, 200, np.uint64(9), step) for step in range(40_000)])
    for part in pairs.T:
        assert stats.kstest(part, "norm").pvalue > 1e-4
    assert abs((pairs[:, 0] * pairs[:, 1]).mean()) < 3.9 / np.sqrt(len(pairs))
    radius = (pairs**2).sum(axis=1)
    assert stats.kstest(radius, "expon", args=(0, 2)).pvalue > 1e-4
    assert abs(np.corrcoef(pairs[:-1, 0], pairs[1:, 0])[0, 1]) < 3.9 / np.sqrt(len(pairs))
    assert normal_pair(KEY, 200, np.uint64(9), 5) == tuple(pairs[5])
