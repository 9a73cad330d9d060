"""Random numbers by counter: a draw is a function of (seed, stream, identity, step) and of nothing else.

So a result depends neither on the number of threads, nor on the order of the draws, nor on an interruption; there is no
generator state to keep. Philox4x32-10: Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3",
SC'11.
"""

import math
from enum import IntEnum
from typing import Any, TypeAlias

import numpy as np

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_lean


class Stream(IntEnum):
    """What a draw is for. Plugins use 200 and up."""

    FORMATION = 1
    RUPTURE = 2
    RECEPTORS = 3
    POSITIONS = 4
    LIGANDS = 5
    THERMAL = 6
    ANCHORS = 7
    CLOCKS = 8


Word: TypeAlias = Any  # an unsigned 64-bit integer, of numpy outside and of the machine inside compiled code

_MASK = np.uint64(0xFFFFFFFF)
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)
_HALF = np.uint64(32)
_ROUNDS = 10


def key_of(seed: int, replicate: int = 0) -> np.uint64:
    """Give the 64-bit key of a seed and a replicate; nearby seeds give unrelated keys."""
    return np.uint64(np.random.SeedSequence(seed, spawn_key=(replicate,)).generate_state(1, np.uint64)[0])


@compiled_lean
def philox(c0: Word, c1: Word, c2: Word, c3: Word, key: Word) -> tuple[Word, Word, Word, Word]:
    """Apply the ten rounds of Philox4x32 to a counter of four 32-bit words, held in uint64."""
    k0 = key & _MASK
    k1 = key >> _HALF
    for _ in range(_ROUNDS):
        product_0 = _MULTIPLIER_0 * c0
        product_1 = _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (
            (product_1 >> _HALF) ^ c1 ^ k0,
            product_1 & _MASK,
            (product_0 >> _HALF) ^ c3 ^ k1,
            product_0 & _MASK,
        )
        k0 = (k0 + _WEYL_0) & _MASK
        k1 = (k1 + _WEYL_1) & _MASK
    return c0, c1, c2, c3


@compiled_lean
def uniform_pair(key: Word, stream: int, identity: Word, step: int) -> tuple[float, float]:
    """Draw two uniform numbers in (0, 1), never 0 or 1, of 52 bits each.

    Parameters
    ----------
    key
        From `key_of`, as uint64.
    stream
        One of `Stream`.
    identity
        Whom the draw is for; any 64-bit number.
    step
        When; below 2^56.
    """
    who = np.uint64(identity)
    when = np.uint64(step)
    last = ((when >> _HALF) & np.uint64(0xFFFFFF)) | (np.uint64(stream) << np.uint64(24))
    a, b, c, d = philox(who & _MASK, who >> _HALF, when & _MASK, last, np.uint64(key))
    first = np.float64((a << np.uint64(20)) | (b >> np.uint64(12)))
    second = np.float64((c << np.uint64(20)) | (d >> np.uint64(12)))
    return (first + 0.5) / 4503599627370496.0, (second + 0.5) / 4503599627370496.0


@compiled_lean
def uniform(key: Word, stream: int, identity: Word, step: int) -> float:
    """Draw one uniform number in (0, 1); see `uniform_pair`."""
    return uniform_pair(key, stream, identity, step)[0]


@compiled_lean
def normal_pair(key: Word, stream: int, identity: Word, step: int) -> tuple[float, float]:
    """Draw two independent standard normal numbers by the method of Box and Muller; arguments as `uniform_pair`."""
    first, second = uniform_pair(key, stream, identity, step)
    radius, angle = math.sqrt(-2 * math.log(first)), 2 * math.pi * second
    return radius * math.cos(angle), radius * math.sin(angle)


@compiled_lean
def mixed(first: Word, second: Word) -> Word:
    """Make one 64-bit identity of two: the finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014) over both."""
    z = np.uint64(first) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(second)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@compiled_lean
def fill_uniform(key: Word, stream: int, identity: Word, first: int, out: Array) -> None:
    """Fill (n, 2) with the pairs of steps `first`, `first` + 1, …"""
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = uniform_pair(key, stream, identity, first + i)
