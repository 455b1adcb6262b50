"""The question (floor, team, start and goal), and enclosures of what moving joints carry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from coop_drake.checking.numbers import (
    BITS,
    ONE,
    TURN,
    RefusedError,
    index,
    norm,
    number,
    numbers,
    spend,
    turn,
)
from coop_drake.checking.planar import Point, Region, hull

Interval = tuple[int, int]
Open = tuple[list[int], dict[int, int]]

COPIES = 4
"""An interval of angles stands for one more turned copies than this; callers halve it where that fails."""


class Step(NamedTuple):
    """A turn by sign * value + angle, a displacement by value * slide, or one by ``offset``.

    The value is that of ``axis`` among (theta, q...); -1 if none is needed.
    """

    axis: int = -1
    sign: int = 0
    angle: int = 0
    slide: Point = (0, 0)
    offset: Point = (0, 0)

    def backwards(self) -> Step:
        """The inverse motion."""
        (u, v), (x, y) = self.slide, self.offset
        return Step(self.axis, -self.sign, -self.angle, (-u, -v), (-x, -y))


class Piece(NamedTuple):
    """A convex piece of a body: the hull of vertices in its component's frame, grown by a radius."""

    body: str
    component: int
    vertices: list[Point]
    radius: int


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
        spread[axis] = spread.get(axis, 0) + (reach * (high - low) >> BITS)
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
            if axis < 0 or part[axis][1] - part[axis][0] < 2:
                raise RefusedError(where, finding)
            (low, high), parts = part[axis], [part.copy(), part.copy()]
            parts[0][axis], parts[1][axis] = (low, (low + high) // 2), ((low + high) // 2, high)
            left += [(half, tested) for half in parts]


class Question:
    """What is asked.

    Args:
        value: The document; the page on certificates in the documentation says what its entries mean.
    """

    def __init__(self, value: Any) -> None:
        if (value["format"], value["version"]) != ("coop_drake question", 1):
            raise RefusedError("question", "is no 'coop_drake question' of version 1")
        self.floor = Region(value["floor"])
        self.parents, self.motions = list[int](), list[list[Step]]()
        self.joints, self.pieces = dict[int, tuple[int, Interval]](), list[Piece]()
        for component in value["components"]:
            self._add(component)
        joints = [self.joints[k] for k in range(len(self.joints))]
        self.robots, self.limits = [robot for robot, _ in joints], [limits for _, limits in joints]
        self.start, self.goal = numbers(value["start"], 3 + len(joints)), numbers(value["goal_pose"], 3)
        goals = [None if goal is None else number(goal) for goal in value["goal_joints"]]
        ends = zip(goals, self.limits, strict=True)
        self.goal_box = [
            (self.goal[2],) * 2,
            *[limits if goal is None else (goal,) * 2 for goal, limits in ends],
        ]
        self.room, angle, joint = (
            number(value[f"{what}_tolerance"]) for what in ("position", "angle", "joint")
        )
        self.rooms = [angle, *[None if goal is None else joint for goal in goals]]
        self.pairs = self._pairs(value["left_aside"])

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

    def _add(self, component: Any) -> None:
        """Read a component; its joint moves it by X_PJ @ Rot(sign * q), or X_PJ @ Trans(direction * q)."""
        joint, place = component["joint"], len(self.parents)
        self.parents.append(index(component["parent"], place) if place else -1)
        if place == 0:
            self.motions.append([Step(0, 1)])
        else:
            axis, (x, y, angle) = 1 + index(joint["index"], 1000), numbers(joint["frame"], 3)
            if joint["kind"] == "prismatic":
                slide = numbers(joint["direction"], 2)
                move = Step(axis, slide=(slide[0], slide[1]))
            else:
                move = Step(axis, {("revolute", 1): 1, ("revolute", -1): -1}[joint["kind"], joint["sign"]])
            self.motions.append([move, Step(angle=angle), Step(offset=(x, y))])
            if axis - 1 in self.joints:
                raise RefusedError("joint", "has the index of another one")
            self.joints[axis - 1] = joint["robot"], (number(joint["lower"]), number(joint["upper"]))
        for body in component["bodies"]:
            for shape in body["shapes"]:
                vertices = hull((x, y) for x, y in (numbers(corner, 2) for corner in shape["vertices"]))
                if not vertices or number(shape["radius"]) < 0:
                    raise RefusedError("shapes", "has no vertices or a negative radius")
                self.pieces.append(Piece(body["name"], place, vertices, number(shape["radius"])))

    def _pairs(self, aside: Any) -> list[tuple[int, int]]:
        """Pairs of pieces that must not meet: those of different components whose bodies are not left aside.

        Bodies that are left aside because of a joint must belong to a component and its parent.
        """
        for one, other, reason in aside:
            owners = [{p.component for p in self.pieces if p.body == name} for name in (one, other)]
            joined = all(a == self.parents[b] or b == self.parents[a] for a in owners[0] for b in owners[1])
            if reason not in ("joint", "model") or (reason == "joint" and not joined):
                raise RefusedError(
                    "left_aside", f"{one} and {other} share no joint, or the reason is unknown"
                )
        names = {frozenset((one, other)) for one, other, _ in aside}
        pairs = [(i, j) for j in range(len(self.pieces)) for i in range(j)]
        ends = [(self.pieces[i], self.pieces[j]) for i, j in pairs]
        apart = [a.component != b.component and frozenset((a.body, b.body)) not in names for a, b in ends]
        return [pair for pair, needed in zip(pairs, apart, strict=True) if needed]
