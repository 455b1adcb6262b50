"""Numbers are integers in units of 2^-80 m or rad; sines and cosines; refusals; the work allowed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import isqrt
from typing import Any

BITS = 80
"""Bits after the point of lengths and angles: 8e-25 m or rad; products of coordinates are exact."""

ONE = 1 << BITS
"""One metre, one radian, or the factor one."""

_FINE = 160
"""Bits after the point inside the computation of sines and cosines."""

_work = [0]


class RefusedError(Exception):
    """A statement that does not hold or was not shown: where in the documents, and what is wrong there."""

    def __init__(self, where: str, finding: str) -> None:
        self.where, self.finding = where, finding
        super().__init__(f"{where}: {finding}")


def allow(steps: int) -> None:
    """Allow so many elementary steps from now on."""
    _work[0] = steps


def spend(steps: int) -> None:
    """Count elementary steps; refuse when more are needed than were allowed."""
    _work[0] -= steps
    if _work[0] < 0:
        raise RefusedError("work", "more steps are needed than allowed; nothing is decided")


def number(value: Any) -> int:
    """Read a number: the multiple of 2^-80 nearest to the double that it stands for."""
    if type(value) not in (int, float) or not -(2**20) <= value <= 2**20:
        raise RefusedError("number", f"{value!r:.40} is none between -2^20 and 2^20")
    above, below = value.as_integer_ratio()
    nearest: int = (2 * above * ONE + below) // (2 * below)
    return nearest


def numbers(values: Any, count: int) -> list[int]:
    """Read a list of so many numbers."""
    if not isinstance(values, list) or len(values) != count:
        raise RefusedError("numbers", f"{values!r:.40} is no list of {count}")
    return [number(value) for value in values]


def index(value: Any, count: int) -> int:
    """Read an index below a count."""
    if type(value) is not int or not 0 <= value < count:
        raise RefusedError("index", f"{value!r:.40} is none from 0 to {count - 1}")
    return int(value)


def norm(vectors: Sequence[tuple[int, int]]) -> int:
    """The greatest length of some vectors, rounded up."""
    return isqrt(max([x * x + y * y for x, y in vectors])) + 1


def _inverse_tangent(n: int) -> int:
    """The arc tangent of 1 / n in units of 2^-160; each of at most 70 terms is rounded by a unit."""
    terms = range(1, 2 * _FINE, 2)
    return sum((-1) ** (k // 2) * ((1 << _FINE) // (k * n**k)) for k in terms if n**k >> _FINE == 0)


_TURN = 8 * (4 * _inverse_tangent(5) - _inverse_tangent(239))
"""2 pi in units of 2^-160 by Machin's formula, wrong by less than 2^-140."""

TURN = _TURN >> (_FINE - BITS)
"""2 pi in units of 2^-80, wrong by less than one unit."""


@lru_cache(maxsize=1 << 16)
def turn(angle: int) -> tuple[int, int]:
    """Cosine and sine of an angle, each wrong by less than one unit.

    The angle is brought into [-pi, pi), wrong by less than 2^-119. Each term of the exponential series is
    rounded by less than a unit of 2^-160, which the factors x / n that follow enlarge to less than 24 (e^pi)
    units, and the series ends when a term vanishes: together that is far less than 2^-100.
    """
    x = ((angle << (_FINE - BITS)) + _TURN // 2) % _TURN - _TURN // 2
    sums, term, n = [0, 0, 0, 0], 1 << _FINE, 0
    while term not in (0, -1):
        sums[n % 4] += term
        n += 1
        term = (term * x >> _FINE) // n
    shift = _FINE - BITS
    return (sums[0] - sums[2] + (1 << shift - 1)) >> shift, (sums[1] - sums[3] + (1 << shift - 1)) >> shift
