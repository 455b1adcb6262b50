"""Random questions by seed: floors, teams, a rod before a bend, arms and discs in each other's way."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Literal

import numpy as np
import shapely
from shapely import Polygon, box, union_all
from shapely.geometry.base import BaseGeometry

from benchmarks.adversaries.collisions import Team
from coop_drake.answers import PlanningProblem
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint
from coop_drake.verification.question import question_of

Random = np.random.Generator


def random_question(seed: int | Sequence[int]) -> PlanningProblem | None:
    """A question whose start is free and whose goal's position is on the floor, None if none was drawn.

    Args:
        seed: The same seed gives the same question.
    """
    random = np.random.default_rng(seed)
    floor, tree = _floor(random), _tree(random)
    team = Team(
        question_of(PlanningProblem(floor, tree, np.zeros(3), np.zeros(3), (None,) * len(tree.joints)))
    )
    ends: list[FloatArray] = []
    for _ in range(2):
        places = random.uniform(floor.bounds[:2], floor.bounds[2:], (200, 2))
        joints = random.uniform(tree.range_lower, tree.range_upper, (200, len(tree.joints)))
        z = np.column_stack((places, random.uniform(-pi, pi, 200), joints))
        free = z[~team.collides(z)]
        if not len(free):
            return None
        away = [float(np.hypot(*(z[:2] - end[:2]))) for z in free[:4] for end in ends]
        ends.append(free[int(np.argmax(away))] if away else free[0])
    start, goal = ends
    if random.random() < 0.15:
        goal[:2] = floor.exterior.interpolate(random.random(), normalized=True).coords[0]
    keep = random.random(len(tree.joints)) < 0.3
    goals = tuple(float(q) if k else None for q, k in zip(goal[3:], keep, strict=True))
    return PlanningProblem(floor, tree, start, goal[:3], goals)


def _floor(random: Random) -> Polygon:
    """A room that a wall with a gap parts, perhaps with pillars, turned and anywhere."""
    width, height = random.uniform(3.5, 7.0), random.uniform(2.5, 5.0)
    floor: BaseGeometry = box(0.0, 0.0, width, height)
    if random.random() < 0.8:
        x, gap, thick = (
            random.uniform(1.2, width - 1.2),
            random.uniform(0.02, 1.3),
            10.0 ** random.uniform(-9.0, 0.0),
        )
        y = random.uniform(0.0, height - gap)
        walls = [box(x, -1.0, x + thick, y), box(x, y + gap, x + thick, height + 1.0)]
        floor = floor.difference(shapely.union_all(walls[: 1 + int(random.random() < 0.7)]))
    for _ in range(int(random.integers(3))):
        corners = random.uniform(-0.4, 0.4, (5, 2)) + random.uniform((0.0, 0.0), (width, height))
        floor = floor.difference(shapely.MultiPoint(corners).convex_hull)
    turn, shift = random.uniform(-pi, pi), random.uniform(-1.0, 1.0, 2) * 10.0 ** random.uniform(-2.0, 4.0)
    c, s = np.cos(turn), np.sin(turn)
    parts = [part for part in shapely.get_parts(floor) if isinstance(part, Polygon)]
    largest = max(parts, key=lambda part: part.area)
    return shapely.transform(largest, lambda xy: xy @ np.array([[c, s], [-s, c]]) + shift)


def _tree(random: Random) -> ComponentTree:
    """An object with up to two robots of up to two joints each."""
    components = [Component("object", None, None, (Body("object", None, _shapes(random, 0.45)),))]
    sharing = set()
    for robot in range(int(random.integers(3))):
        parent, above, place = 0, "object", PlanarPose(0.3, 0.0, 0.0)
        for _ in range(int(random.integers(1, 3))):
            index, name = len(components) - 1, f"robot_{robot}::link_{len(components)}"
            X_PJ = PlanarPose(0.0, 0.0, pi * robot if parent == 0 else 0.0) @ place
            kind: Literal["revolute", "prismatic"] = "revolute" if random.random() < 0.7 else "prismatic"
            most = random.uniform(0.3, 1.9) if kind == "revolute" else random.uniform(0.05, 0.4)
            sign = float(random.choice([-1.0, 1.0]))
            joint = TreeJoint(f"{name}_joint", kind, robot, index, X_PJ, sign, (1.0, 0.0), -most, most)
            components.append(Component(name, parent, joint, (Body(name, robot, _shapes(random, 0.15)),)))
            sharing.add((name, above))
            parent, above, place = len(components) - 1, name, PlanarPose(random.uniform(0.2, 0.5), 0.0, 0.0)
    return ComponentTree(tuple(components), frozenset(sharing))


def _shapes(random: Random, size: float) -> tuple[ConvexShape, ...]:
    """One or two convex pieces: polygons, discs, capsules and rounded polygons."""
    return tuple(_shape(random, size) for _ in range(int(random.integers(1, 3))))


def _shape(random: Random, size: float) -> ConvexShape:
    count = int(random.choice([1, 2, 4, 5]))
    hull = shapely.MultiPoint(size * random.uniform(-1.0, 1.0, (count, 2))).convex_hull
    ring: FloatArray = shapely.get_coordinates(shapely.orient_polygons(hull))
    vertices = ring[:-1] if len(ring) > 2 else ring
    radius = size * random.uniform(0.1, 0.6) if len(vertices) < 3 or random.random() < 0.3 else 0.0
    return ConvexShape(np.ascontiguousarray(vertices), float(radius))


Carrier = Literal["object", "revolute", "prismatic"]

LONGEST = 2.0 * 2.0**0.5
"""A thin rod that turns a right-angled corner is at most so many widths of the corridors long [-]."""


def bend_question(seed: int, carrier: Carrier, *, in_corridor: bool = False) -> PlanningProblem:
    """Two rooms that a corridor with a right-angled bend joins, turned and anywhere; a rod is to go through.

    Args:
        seed: The same seed gives the same question.
        carrier: Whether the rod is the object, or hangs at the object, a small disc, by a joint.
        in_corridor: Whether the goal lies in the first half of the corridor, where the rod all but fits
            at one limit of its joint.
    """
    random = np.random.default_rng(seed)
    length, thick, turn = random.uniform(1.0, 1.6), random.uniform(0.1, 0.2), random.uniform(-pi, pi)
    width = length / LONGEST * random.uniform(0.6, 0.95)
    tree = _rod(carrier, length, thick, random)
    rooms = [box(0.0, 0.0, 2.4, 2.4), box(3.0, 2.0, 5.4, 4.4)]
    ways = [box(0.7, 2.3, 0.7 + width, 2.9 + width), box(0.7, 2.9, 3.1, 2.9 + width)]
    matrix = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    shift = random.uniform(-1.0, 1.0, 2) * 10.0 ** random.uniform(-2.0, 3.0)
    floor = shapely.transform(union_all([*rooms, *ways]), lambda xy: xy @ matrix + shift)
    assert isinstance(floor, Polygon)
    count, goal = len(tree.joints), (0.7 + 0.5 * width, 2.7) if in_corridor else (4.2, 3.2)
    start = np.array([*(np.array([1.2, 1.2]) @ matrix + shift), random.uniform(-pi, pi), *[0.0] * count])
    most = tree.joint_upper.max(initial=0.0) if carrier == "revolute" else 0.0
    aslant = turn + 0.5 * pi + 1.05 * np.arcsin(width / length) + most
    goal_pose = np.array(
        [*(np.array(goal) @ matrix + shift), aslant if in_corridor else random.uniform(-pi, pi)]
    )
    return PlanningProblem(floor, tree, start, goal_pose, (None,) * count)


def _rod(carrier: Carrier, length: float, thick: float, random: np.random.Generator) -> ComponentTree:
    x, y = 0.5 * length, 0.5 * thick
    rod = ConvexShape(np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))
    if carrier == "object":
        return ComponentTree((Component("object", None, None, (Body("object", None, (rod,)),)),), frozenset())
    most = random.uniform(0.05, 0.3 if carrier == "revolute" else 0.2)
    joint = TreeJoint("joint", carrier, 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -most, most)
    disc = Body("object", None, (ConvexShape(np.zeros((1, 2)), 0.6 * thick),))
    arm = Component("arm", 0, joint, (Body("arm", 0, (rod,)),))
    return ComponentTree((Component("object", None, None, (disc,)), arm), frozenset({("object", "arm")}))


REACH, HALF_WIDTH = 0.6, 0.03
"""How far the arms reach from their joints, half their width [m]."""


def crossing_question(seed: int, *, crossed: str) -> PlanningProblem:
    """A bar with two arms in a hall; turned inwards, the first one crosses the other at all of its angles.

    Args:
        seed: The same seed gives the same question.
        crossed: Where the first arm is turned inwards: at the ``start``, at the ``goal``, or ``nowhere``.
    """
    random = np.random.default_rng(seed)
    apart, inwards, outwards = random.uniform((0.1, 0.5, 0.6), (0.15, 0.7, 0.9)).tolist()
    other = (0.2, float(random.uniform(0.5, 0.9)))
    limits, arms = ((-1.0, 1.0), other), []
    for k, (low, high) in enumerate(limits):
        joint = TreeJoint(
            f"joint_{k}", "revolute", k, k, PlanarPose(0.2, (apart, -apart)[k]), 1.0, (1.0, 0.0), low, high
        )
        arms.append(
            Component(f"arm_{k}", 0, joint, (Body(f"arm_{k}", k, (_plate(0.0, REACH, HALF_WIDTH),)),))
        )
    bar = Component("bar", None, None, (Body("bar", None, (_plate(-0.2, 0.2, 0.2),)),))
    tree = ComponentTree((bar, *arms), frozenset({("arm_0", "bar"), ("arm_1", "bar")}))
    ends = random.uniform((1.1, 1.1, -pi), (3.9, 2.9, pi), (2, 3))
    first = -inwards if crossed == "start" else outwards
    goal = -inwards if crossed == "goal" else outwards
    return PlanningProblem(
        box(0, 0, 5, 4), tree, np.array([*ends[0], first, other[0]]), ends[1], (goal, None)
    )


def discs_in_a_corridor(width: float) -> PlanningProblem:
    """Two discs of 0.3 m whose centres may be 0.5 m to 0.7 m apart shall change their order.

    Args:
        width: Of the corridor [m]; where there is no way, walls squeeze the discs together.
    """
    joint = TreeJoint("slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), 0.5, 0.7)
    disc = ConvexShape(np.zeros((1, 2)), 0.3)
    components = (
        Component("object", None, None, (Body("first", None, (disc,)),)),
        Component("slider", 0, joint, (Body("second", 0, (disc,)),)),
    )
    start, goal = np.array([3.0, 0.5, 0.0, 0.65]), np.array([3.0, 0.5, pi])
    tree = ComponentTree(components, frozenset())
    return PlanningProblem(box(0.0, 0.0, 6.0, width), tree, start, goal, (None,))


def _plate(x_lower: float, x_upper: float, y: float) -> ConvexShape:
    return ConvexShape(np.array([[x_lower, -y], [x_upper, -y], [x_upper, y], [x_lower, y]]))
