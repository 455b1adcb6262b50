"""Exact plane geometry: lengths and angles are integers in units of 2^-80 m and rad.

A point is a pair of integers; a convex set is the list of its hull's corners, counter-clockwise, no three of
them on a line. Only sines, cosines, and places on a segment are rounded, with stated bounds. What is rounded
encloses: the text of each function says on which side it errs.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from math import isqrt
from typing import Any

Point = tuple[int, int]
Interval = tuple[int, int]
Box = list[Interval]
Bounds = Sequence[int]  # (x_min, y_min, x_max, y_max)
Progress = Callable[[str, float], object]

BITS = 80
ONE = 1 << BITS
"""The number 1 in units of 2^-80."""

FINE_TURN = 0x6_487ED511_0B4611A6_2633145C_06E0E689_48127044
TURN = FINE_TURN >> BITS
"""2 pi, rounded down to a multiple of 2^-160, and of 2^-80."""

work_left = [0]  # Elementary steps that are still allowed.


class RefusedError(Exception):
    """A statement that does not hold or was not shown: where in the documents, and what is wrong there."""


def demand(fulfilled: bool, where: str, finding: str) -> None:
    """Refuse what is not fulfilled."""
    if not fulfilled:
        raise RefusedError(f"{where}: {finding}")


def spend(steps: int) -> None:
    """Count elementary steps; refuse when more are needed than are allowed."""
    work_left[0] -= steps
    demand(work_left[0] >= 0, "work", "more steps are needed than are allowed: undecided")


def numbers(values: Any, count: int) -> list[int]:
    """Read so many numbers: each stands for a double, and denotes the multiple of 2^-80 nearest to it."""
    spend(200 * count)
    fit = isinstance(values, list) and all(type(v) in (int, float) and abs(v) <= 2**20 for v in values)
    demand(fit and len(values) == count, "numbers", f"{values!r:.60} are not {count} between -2^20 and 2^20")
    return [(2 * ONE * a + b) // (2 * b) for a, b in (value.as_integer_ratio() for value in values)]


def points(values: Any) -> list[Point]:
    """Read points ``[x, y]``, at least one."""
    demand(isinstance(values, list) and len(values) > 0, "points", f"{values!r:.40} are none")
    return [(x, y) for x, y in [numbers(value, 2) for value in values]]


def index(value: Any, count: int) -> int:
    """Read an index below a count."""
    demand(type(value) is int and 0 <= value < count, "index", f"{value!r:.40} is none below {count}")
    return int(value)


@lru_cache(maxsize=1 << 16)
def cosine_and_sine(angle: int) -> Point:
    """Cosine and sine of an angle, each wrong by less than one unit.

    The angle is brought into [-pi, pi), wrong by less than 2^-119. Each term of the exponential series is
    rounded by less than a unit of 2^-160, which the factors x / n that follow enlarge to less than 24 (e^pi)
    units, and the series ends when a term vanishes: together that is far less than 2^-100.
    """
    x = ((angle << BITS) + FINE_TURN // 2) % FINE_TURN - FINE_TURN // 2
    sums, term, n = [0, 0, 0, 0], ONE * ONE, 0
    while term not in (0, -1):
        sums[n % 4] += term
        n += 1
        term = (term * x >> 2 * BITS) // n
    return (sums[0] - sums[2] + ONE // 2) >> BITS, (sums[1] - sums[3] + ONE // 2) >> BITS


def hull(corners: Iterable[Point]) -> list[Point]:
    """Corners of the convex hull, counter-clockwise, no three on a line (monotone chain)."""
    ordered, found = sorted(set(corners)), list[Point]()
    spend(10 + 5 * len(ordered))
    for chain in (ordered, ordered[::-1]):
        half = list[Point]()
        for x, y in chain:
            while len(half) > 1:
                (ax, ay), (bx, by) = half[-2:]
                if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                    break
                half.pop()
            half.append((x, y))
        found += half[:-1]
    return found or ordered


def difference(first: Sequence[Point], second: Sequence[Point]) -> list[Point]:
    """Corners of all a - b of two convex sets, counter-clockwise, no three on a line; exact.

    Edges of both sets, of the second one turned by pi, follow each other by their directions from that of +x.
    Edges of both that come next differ by less than pi, so that the sign of their cross product orders them.
    All of this holds for strictly convex rings alone; others are refused.
    """
    spend(10 + 5 * (len(first) + len(second)))
    (x, y), one = _edges(first)
    (p, q), other = _edges([(-x, -y) for x, y in second])
    x, y, i, j = x + p, y + q, 0, 0
    found = [(x, y)]
    while i < len(one) or j < len(other):
        (a, b), (c, d) = one[i] if i < len(one) else (0, 0), other[j] if j < len(other) else (0, 0)
        turn = a * d - b * c  # 0 also where only one set has edges left.
        if turn >= 0:
            x, y, i = x + a, y + b, i + 1
        if turn <= 0:
            x, y, j = x + c, y + d, j + 1
        found.append((x, y))
    return found[:-1] or found


def _edges(ring: Sequence[Point]) -> tuple[Point, list[Point]]:
    """The lowest corner, of several the one furthest to the left, and the edges from there; of a point none.

    Refuses a ring that is not strictly convex. In one that is, each edge turns to the left of the one before;
    from the lowest corner on, edges first have directions from 0 to less than pi, then the others: the ring
    goes round once. A segment has two edges. One whose ends are the same is a point.
    """
    if len(ring) <= 2 and ring[0] == ring[-1]:
        return ring[0], []
    lowest = min(range(len(ring)), key=lambda k: (ring[k][1], ring[k][0]))
    turned = [*ring[lowest:], *ring[: lowest + 1]]
    edges = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(turned)]
    convex = rising = True
    for (a, b), (c, d) in pairwise(edges):
        rises = d > 0 or (d == 0 and c > 0)
        convex = convex and (a * d > b * c or len(edges) == 2) and rising >= rises
        rising = rises
    demand(convex, "convex set", "has corners that repeat, lie on a line, or are not in a convex order")
    return turned[0], edges


def box_of(corners: Iterable[Point]) -> tuple[int, int, int, int]:
    """The bounding box, see ``Bounds``."""
    xs, ys = zip(*corners, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def boxes_near(boxes: Sequence[Bounds], among: Iterable[int], box: Bounds, gap: int) -> list[int]:
    """Those of numbered boxes that are not further than a gap [2^-80 m] from a box, neither along x nor y."""
    low_x, low_y, high_x, high_y = box[0] - gap, box[1] - gap, box[2] + gap, box[3] + gap
    found = []
    for k in among:
        x0, y0, x1, y1 = boxes[k]
        if x0 <= high_x and low_x <= x1 and y0 <= high_y and low_y <= y1:
            found.append(k)
    return found


def boxes_apart(a: Bounds, b: Bounds, gap: int) -> bool:
    """Whether two boxes are further apart than a gap [2^-80 m] along x or along y."""
    return not boxes_near([a], (0,), b, gap)


def apart(first: Sequence[Point], second: Sequence[Point], gap: int) -> bool:
    """Whether the distance of two convex sets is larger than a gap [2^-80 m]: the origin's from a - b.

    The set of all a - b is tested at the lines of its edges, and at its corner nearest to the origin. Exact.
    Sets that are not strictly convex are refused, unless their boxes are apart.
    """
    if boxes_apart(box_of(first), box_of(second), gap):
        return True
    corners = difference(first, second)
    for (x, y), (p, q) in pairwise([corners[-1], *corners]):
        right = (p - x) * y - (q - y) * x
        if right > 0 and right * right > gap * gap * ((p - x) ** 2 + (q - y) ** 2):
            return True
    square, (x, y) = min((x * x + y * y, (x, y)) for x, y in corners)
    least = min([x * p + y * q for p, q in corners])
    return least > 0 and least * least > gap * gap * square


def nearer(point: Point, segment: Sequence[Point], gap: int) -> bool:
    """Whether a point is nearer to a segment than a gap [2^-80 m]; exact."""
    (x, y), ((ax, ay), (bx, by)) = point, segment
    x, y, dx, dy = x - ax, y - ay, bx - ax, by - ay
    along, square = x * dx + y * dy, dx * dx + dy * dy
    if 0 < along < square:
        return gap > 0 and (x * dy - y * dx) ** 2 < gap * gap * square
    return gap > 0 and min(x * x + y * y, (x - dx) ** 2 + (y - dy) ** 2) < gap * gap


def below(corners: Sequence[Point], grown: int, direction: Point, bound: int) -> tuple[list[Point], int]:
    """Enclose the part of a grown convex set where u . x <= bound [2^-160], by its corners and growth.

    Of a point that is in the part, the point of the ungrown set that is nearest to it lies where u . x is
    larger by the growth times |u| at most: there the ungrown set is cut, at a line that errs outwards.
    Where an edge crosses that line, the corner is rounded by less than 2 units to any side, by which the
    result grows. Such a corner may make its neighbours lie inside, so that the hull is taken again: its edges
    are the lines that bound it, however short they are.
    """
    (u, v), found = direction, list[Point]()
    bound += (isqrt(u * u + v * v) + 1) * grown
    levels = [(p, u * p[0] + v * p[1] - bound) for p in corners]
    for (a, s), (b, t) in pairwise([levels[-1], *levels]):
        if (s <= 0) != (t <= 0):
            found.append(((b[0] * s - a[0] * t) // (s - t), (b[1] * s - a[1] * t) // (s - t)))
        found += [b] if t <= 0 else []
    return hull(found), grown + 2
