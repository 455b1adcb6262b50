"""Random numbers that follow from a seed and a number, such as that of a control period, and nothing else.

They are computed by Philox4x32-10 (Salmon, Moraes, Dror and Shaw, 2011, "Parallel random numbers: as easy
as 1, 2, 3"): a bijection of 128 bits, the counter, that depends on 64 bits, the key. Nothing is kept from
one draw to the next, so that a draw is the same in whatever order, in a block or in a compiled loop.
"""

from __future__ import annotations

from math import cos, log, pi, sin, sqrt

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

_WORD = 0xFFFFFFFF
_UNIT = 2.0**-32
"""A word of 32 bits times this is in [0, 1) [-]."""

_FACTOR_0, _FACTOR_1 = 0xD2511F53, 0xCD9E8D57
_STEP_0, _STEP_1 = 0x9E3779B9, 0xBB67AE85
_ROUNDS = 10
"""Multipliers, steps of the key and number of rounds, as published."""


@compiled(borrows=True)
def random_words(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the four words of Philox4x32-10, each from 0 to 2^32 - 1.

    Args:
        counter: Four words of 32 bits.
        key: Two words of 32 bits.
    """
    a, b, c, d = counter
    k, m = key
    for _ in range(_ROUNDS):
        # Products may overflow 63 bits, which changes only bits that the masks take away.
        p, q = _FACTOR_0 * a, _FACTOR_1 * c
        a, b, c, d = ((q >> 32) & _WORD) ^ b ^ k, q & _WORD, ((p >> 32) & _WORD) ^ d ^ m, p & _WORD
        k, m = (k + _STEP_0) & _WORD, (m + _STEP_1) & _WORD
    return a, b, c, d


@compiled
def uniform_pair(seed: int, number: int) -> tuple[float, float]:
    """Return two independent numbers that are uniform in [0, 1), in steps of 2^-32 [-].

    Args:
        seed: Which sequence, from 0 to 2^32 - 1.
        number: Which pair of the sequence, not negative.
    """
    words = random_words((number & _WORD, number >> 32, 0, 0), (seed, 0))
    return _UNIT * words[0], _UNIT * words[1]


@compiled(borrows=True)
def write_normals(seed: int, number: int, normals: FloatArray) -> None:
    """Write independent numbers with a standard normal distribution, by the formula of Box and Muller [-].

    None is beyond 6.7 standard deviations, because uniform numbers come in steps of 2^-32.

    Args:
        seed: Which sequence, from 0 to 2^32 - 1.
        number: Which draw of the sequence, not negative.
        normals: Receives the numbers, shape (n,).
    """
    for i in range(0, normals.size, 4):
        words = random_words((number & _WORD, number >> 32, 1 + i, 0), (seed, 0))
        for k in range(2):
            length = sqrt(-2.0 * log(_UNIT * (words[2 * k] + 0.5)))
            angle = 2.0 * pi * _UNIT * words[2 * k + 1]
            first = i + 2 * k
            if first + 1 < normals.size:  # Both, so that one function of the C library makes both.
                normals[first], normals[first + 1] = length * cos(angle), length * sin(angle)
            elif first < normals.size:
                normals[first] = length * cos(angle)
