"""The question (floor, team, start and goal), and enclosures of what moving joints carry."""

from math import isqrt
from typing import Any, NamedTuple

from coop_drake.checking import plane
from coop_drake.checking.plane import BITS, ONE, TURN, Interval, Point, demand, hull, index, numbers, points
from coop_drake.checking.regions import read_region

LARGEST = 1 << 20
"""No number of a document is larger [m or rad]: a circle has these limits."""


class Step(NamedTuple):
    """The motion p -> Rot(sign * value + angle) p + value * slide + offset, by the value of an axis."""

    axis: int = 0
    sign: int = 0
    angle: int = 0
    slide: Point = (0, 0)
    offset: Point = (0, 0)


class Piece(NamedTuple):
    """A convex piece of a body: the hull of corners, grown by a radius, and the steps that carry it to W."""

    body: str
    chain: list[Step]
    corners: list[Point]
    radius: int


def relative(chain: list[Step], other: list[Step]) -> list[Step]:
    """The motion from one frame to another: steps of the first to W, the other's in reverse, none shared."""
    while chain and other and chain[-1] == other[-1]:
        chain, other = chain[:-1], other[:-1]
    for axis, sign, angle, (u, v), (x, y) in reversed(other):
        chain = [*chain, Step(axis, 0, 0, (-u, -v), (-x, -y)), Step(axis, -sign, -angle)]
    return chain


def swept(
    corners: list[Point], grown: int, steps: list[Step], box: plane.Box, copies: int = 4
) -> tuple[list[Point], int]:
    """Enclose what a grown convex set meets that is moved by steps, at all values of a box of (theta, q...).

    An interval of angles stands for so many turned copies and one more. Between two that differ by an angle
    b, a point at the distance r from the pivot is nowhere further than r (1 - cos(b / 2)) <= r b^2 / 8 from
    the segment of its two places. More than a turn fills a disc. A slide lies in the hull of its ends. Each
    copy is rounded by less than 4 r / 2^80 + 2 units, its r b^2 / 8 by less than one, each place by less than
    2: the growth, which counts all of it, makes the result larger than what is enclosed, never smaller.
    Returns a hull, and its growth [2^-80 m].
    """
    for axis, sign, angle, (u, v), (x, y) in steps:
        demand(len(corners) <= 10**4, "corners", "are too many for a convex set that moves")
        first, last = sorted(sign * value + angle for value in box[axis])
        reach, parts = isqrt(max([x * x + y * y for x, y in corners])) + 1, copies if first < last else 1
        if last - first > TURN:
            corners, grown = [(0, 0)], grown + reach
        elif first or last:
            turns = [first + (last - first) * k // parts for k in range(parts + (first < last))]
            pairs = [(*plane.cosine_and_sine(turn), p, q) for turn in turns for p, q in corners]
            corners = [((c * p - s * q) >> BITS, (s * p + c * q) >> BITS) for c, s, p, q in pairs]
            grown += (reach >> BITS - 2) + 4 + (reach * ((last - first) // parts + 1) ** 2 >> 2 * BITS + 3)
        ends = {(u * value // ONE + x, v * value // ONE + y) for value in box[axis]}
        corners, grown = hull((p + a, q + b) for p, q in corners for a, b in ends), grown + 2
    return corners, grown


def free(corners: list[Point], grown: int, steps: list[Step], box: plane.Box, items: Any, clear: Any) -> bool:
    """Whether all items are clear of what a grown convex set meets, moved by steps with all values in a box.

    What is not clear of an enclosure is tried again in both halves of the box; its widest axis is halved.
    """
    parts, axes = [(box, items)], [step.axis for step in steps if step.sign or any(step.slide)]
    while parts:
        part, left = parts.pop()
        enclosure = swept(corners, grown, steps, part)
        if left := [one for one in left if not clear(one, *enclosure)]:
            width, axis = max([(part[axis][1] - part[axis][0], axis) for axis in axes], default=(0, 0))
            if width < 2:
                return False
            low, high = part[axis]
            halves = (low, (low + high) // 2), ((low + high) // 2, high)
            parts += [([*part[:axis], half, *part[axis + 1 :]], left) for half in halves]
    return True


def unwrapped(angles: Interval, about: Interval, *, outwards: int) -> Interval:
    """Angles moved by whole turns to be nearest to others: an enclosure (outwards 1), or a part of them (-1).

    ``TURN`` is less than a turn by less than a unit, so that each end is off by less than a unit a turn.
    If angles that are moved otherwise meet the others, those that are enclosed here do, too: the distance of
    the middles is half of ``TURN`` at most here, and that less a unit a turn at least there. More than a turn
    of angles are all angles.
    """
    if angles[1] - angles[0] > TURN:
        return -LARGEST * ONE, LARGEST * ONE
    turns = (sum(about) - sum(angles) + TURN) // (2 * TURN)
    off = outwards * abs(turns)
    return angles[0] + turns * TURN - off, angles[1] + turns * TURN + off


def holds(outer: list[Interval], inner: list[Interval]) -> bool:
    """Whether intervals hold others, axis by axis."""
    return all(a[0] <= b[0] and b[1] <= a[1] for a, b in zip(outer, inner, strict=True))


def intervals(lower: Any, upper: Any, axes: int, least: int = 0) -> list[Interval]:
    """Read intervals from their ends, each at least so wide."""
    found = list(zip(numbers(lower, axes), numbers(upper, axes), strict=True))
    demand(all(low + least <= high for low, high in found), "upper", "is below lower, or too near to it")
    return found


class Question:
    """What is asked; the page on certificates in the documentation says what the document's entries mean.

    ``circles`` are the axes of (theta, q...) on which values that differ by whole turns are one. The goal is
    a closed set: positions in the disc of the radius ``room`` about ``goal``, and values of all axes in
    ``goal_box``. The interval of a joint whose goal is beyond its limits is empty: its lower end is above its
    upper end.
    """

    def __init__(self, value: Any) -> None:
        asked, parts = (value["format"], value["version"]), (value["components"], value["pieces"])
        fit = asked == ("coop_drake question", 3) and max(map(len, parts)) <= 1000
        demand(fit, "question", "is not of version 3, or has more than 1000 components or pieces")
        self.floor, self.chains = read_region(value["floor"]), [[Step(0, 1)]]
        ends = list(zip(value["lower"], value["upper"], strict=True))
        self.circles = {0, *(axis for axis, pair in enumerate(ends, 1) if pair == (None, None))}
        pairs = [pair if pair != (None, None) else (-LARGEST, LARGEST) for pair in ends]
        self.limits = [intervals([low], [high], 1)[0] for low, high in pairs]
        self.axes, self.pieces = 1 + len(self.limits), list[Piece]()
        for part in value["components"]:
            axis, sign = 1 + index(part["joint"], len(self.limits)), index(part["sign"] + 1, 3) - 1
            (angle,), (slide, offset) = numbers([part["angle"]], 1), points([part["slide"], part["offset"]])
            turns = slide == (0, 0) or axis not in self.circles
            demand(turns, "question.components", "slide by the value of a joint that is a circle")
            above = self.chains[index(part["parent"], len(self.chains))]
            self.chains.append([Step(axis, sign, angle, slide, offset), *above])
        for part in value["pieces"]:
            chain, corners = self.chains[index(part["component"], len(self.chains))], points(part["corners"])
            self.pieces.append(Piece(str(part["body"]), chain, hull(corners), *numbers([part["radius"]], 1)))
            demand(self.pieces[-1].radius >= 0, "question.pieces", "have a negative radius")
        for i, j, reason in value["left_aside"]:
            one, other = self.pieces[i].chain, self.pieces[j].chain
            known = reason == "model" or (reason == "joint" and (one[1:] == other or other[1:] == one))
            demand(known, "question.left_aside", f"pieces {i} and {j} share no joint")
        aside = {(i, j) for i, j, _ in value["left_aside"]}
        numbered = [(i, j) for j in range(len(self.pieces)) for i in range(j) if (i, j) not in aside]
        self.pairs = [(i, j) for i, j in numbered if self.pieces[i].chain != self.pieces[j].chain]
        (self.start, self.goal), angles = points([value["start"][:2], value["goal"]]), value["start"][2:]
        self.start_box = intervals(angles, angles, self.axes)
        demand(holds(self.limits, self.start_box[1:]), "question.start", "is beyond the limits of a joint")
        aims = list(zip(value["goal_lower"], value["goal_upper"], strict=True))
        free = {axis for axis in self.circles if aims[axis] == (None, None)}
        known = [(0, 0) if axis in free else aim for axis, aim in enumerate(aims)]
        ends = intervals([low for low, _ in known], [high for _, high in known], self.axes)
        self.room, *rooms = numbers(value["tolerances"], 1 + self.axes)
        demand(min(self.room, *rooms) >= 0, "question.tolerances", "are negative")
        self.goal_box = [(low - room, high + room) for (low, high), room in zip(ends, rooms, strict=True)]
        for axis, (low, high) in enumerate(self.limits, 1):
            if axis not in self.circles:
                self.goal_box[axis] = max(self.goal_box[axis][0], low), min(self.goal_box[axis][1], high)
        for axis in free:  # A whole turn, rounded outwards.
            self.goal_box[axis] = -(TURN // 2) - 1, TURN // 2 + 1
