"""The question (floor, team, start and goal), and enclosures of what moving joints carry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from coop_drake.checking.plane import (
    BITS,
    ONE,
    TURN,
    Point,
    Region,
    demand,
    hull,
    index,
    norm,
    numbers,
    spend,
    turn,
)  # fmt: skip

Interval = tuple[int, int]
Open = tuple[list[int], dict[int, int]]

COPIES = 4
"""An interval of angles stands for one more turned copies than this; callers halve it where that fails."""


class Step(NamedTuple):
    """A turn by sign * value + angle, or a displacement by value * slide + offset.

    The value is that of ``axis`` among (theta, q...); -1 if none is needed.
    """

    axis: int = -1
    sign: int = 0
    angle: int = 0
    slide: Point = (0, 0)
    offset: Point = (0, 0)


class Piece(NamedTuple):
    """A convex piece of a body: the hull of vertices in its component's frame, grown by a radius."""

    body: str
    component: int
    vertices: list[Point]
    radius: int


def backwards(steps: Sequence[Step]) -> list[Step]:
    """The inverse of a motion."""
    return [Step(a, -s, -t, (-u, -v), (-x, -y)) for a, s, t, (u, v), (x, y) in reversed(steps)]


def swept(points: Sequence[Point], steps: Sequence[Step], box: Sequence[Any]) -> tuple[list[Point], int, Any]:
    """Enclose what a convex set meets that is moved by steps, at all values of a box of (theta, q...).

    Between two copies turned by angles that differ by b, a point at the distance r from the pivot is nowhere
    further than r (1 - cos(b / 2)) <= r b^2 / 8 from the segment of its two places. More than a turn fills a
    disc. A slide lies in the hull of its ends. Each copy is rounded by less than 4 r / 2^80 + 3 units.

    Returns:
        Vertices of a hull and a radius to grow it by; for each axis how far it moves points, about.
    """
    error, spread = 0, dict[int, int]()
    for axis, sign, angle, (sx, sy), (ox, oy) in steps:
        low, high = box[axis] if axis >= 0 else (0, 0)
        if sign or angle:
            low, high = sorted((sign * low + angle, sign * high + angle))
            reach, count = norm(points), COPIES if low < high else 1
            if high - low > TURN:
                points, error = [(0, 0)], error + reach
                continue
            gap = (high - low) // count + 1
            turns = [turn(low + (high - low) * k // count) for k in range(count + (low < high))]
            points = [((c * x - s * y) >> BITS, (s * x + c * y) >> BITS) for c, s in turns for x, y in points]
            error += (reach >> (BITS - 2)) + 4 + (reach * gap * gap >> (2 * BITS + 3))
        else:
            ends = {(sx * value // ONE + ox, sy * value // ONE + oy) for value in (low, high)}
            reach, error = norm([(sx, sy)]), error + 2
            points = [(x + u, y + v) for x, y in points for u, v in ends]
        spread[axis] = spread.get(axis, 0) + reach * (high - low)
        spend(len(points))
        points = hull(points)
    return list(points), error, spread


def bisect(box: Sequence[Any], all_: list[int], test: Callable[..., Open], where: str, finding: str) -> None:
    """Halve a box until a test leaves nothing open in any part; halves test what their whole left open."""
    left = [(list(box), all_)]
    while left:
        part, tested = left.pop()
        tested, spread = test(part, tested)
        if tested:
            axis = max(spread, key=lambda axis: (axis >= 0) * spread[axis], default=-1)
            demand(axis >= 0 and part[axis][1] - part[axis][0] > 1, where, finding)
            (low, high), parts = part[axis], [part.copy(), part.copy()]
            parts[0][axis], parts[1][axis] = (low, (low + high) // 2), ((low + high) // 2, high)
            left += [(half, tested) for half in parts]


class Question:
    """What is asked; the page on certificates in the documentation says what the document's entries mean."""

    def __init__(self, value: Any) -> None:
        asked = (value["format"], value["version"]) == ("coop_drake question", 1)
        demand(asked, "question", "is no 'coop_drake question' of version 1")
        self.floor = Region(value["floor"])
        self.parents, self.motions, self.pieces = list[int](), list[list[Step]](), list[Piece]()
        joints = dict[int, tuple[int, Interval]]()
        for component in value["components"]:
            self._add(component, joints)
        self.robots = [joints[k][0] for k in range(len(joints))]
        self.limits = [joints[k][1] for k in range(len(joints))]
        self.start, self.goal = numbers(value["start"], 3 + len(joints)), numbers(value["goal_pose"], 3)
        tolerances = [value[f"{what}_tolerance"] for what in ("position", "angle", "joint")]
        self.room, angle, joint = numbers(tolerances, 3)
        goals = [None if goal is None else numbers([goal], 1)[0] for goal in value["goal_joints"]]
        ends = [both if goal is None else (goal, goal) for goal, both in zip(goals, self.limits, strict=True)]
        self.goal_box = [(self.goal[2], self.goal[2]), *ends]
        self.rooms = [angle, *[None if goal is None else joint for goal in goals]]
        aside = {self._left_aside(*entry) for entry in value["left_aside"]}
        pairs = [(i, j) for j in range(len(self.pieces)) for i in range(j)]
        self.pairs = [(i, j) for i, j in pairs if self._must_be_apart(self.pieces[i], self.pieces[j], aside)]

    def steps(self, component: int, ancestor: int = -1) -> list[Step]:
        """Motions from a component's frame to an ancestor's; for -1 to p_WL = 0, in directions of W."""
        steps = list[Step]()
        while component != ancestor:
            steps += self.motions[component]
            component = self.parents[component]
        return steps

    def common(self, pair: Sequence[int]) -> int:
        """The nearest common component of two pieces."""
        first, second = sorted(self.pieces[k].component for k in pair)
        while first != second:  # Parents stand before children.
            first, second = sorted((first, self.parents[second]))
        return first

    def _left_aside(self, one: str, other: str, reason: str) -> frozenset[str]:
        """Names of two bodies that need not be apart; where the reason is a joint, it must join them."""
        owner = {piece.body: piece.component for piece in self.pieces}
        first, second = sorted((owner.get(one, -1), owner.get(other, -1)))
        joined = 0 <= first == self.parents[second] or first < 0  # a body without pieces meets nothing
        demand(reason != "joint" or joined, "left_aside", f"{one} and {other} share no joint")
        return frozenset((one, other))

    @staticmethod
    def _must_be_apart(one: Piece, other: Piece, aside: set[frozenset[str]]) -> bool:
        return one.component != other.component and frozenset((one.body, other.body)) not in aside

    def _add(self, component: Any, joints: dict[int, tuple[int, Interval]]) -> None:
        """Read a component; its joint moves it by X_PJ @ Rot(sign * q), or X_PJ @ Trans(direction * q)."""
        joint, place = component["joint"], len(self.parents)
        self.parents.append(index(component["parent"], place) if place else -1)
        motion = [Step(0, 1)]
        if place:
            axis, (x, y, angle) = 1 + index(joint["index"], 1000), numbers(joint["frame"], 3)
            kinds = {("prismatic", None): 0, ("revolute", 1): 1, ("revolute", -1): -1}
            slides = joint["kind"] == "prismatic"
            u, v = numbers(joint["direction"], 2) if slides else (0, 0)
            sign = kinds[joint["kind"], None if slides else joint["sign"]]
            motion = [Step(axis, sign, slide=(u, v)), Step(angle=angle), Step(offset=(x, y))]
            low, high = numbers([joint["lower"], joint["upper"]], 2)
            joints[axis - 1] = joint["robot"], (low, high)
        self.motions.append(motion)
        for body in component["bodies"]:
            for shape in body["shapes"]:
                vertices = [(x, y) for x, y in (numbers(corner, 2) for corner in shape["vertices"])]
                (radius,) = numbers([shape["radius"]], 1)
                demand(len(vertices) > 0 and radius >= 0, "shapes", "have no vertices or a negative radius")
                self.pieces.append(Piece(body["name"], place, hull(vertices), radius))
