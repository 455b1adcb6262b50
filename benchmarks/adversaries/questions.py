"""Random questions by seed: floors with walls, pillars and aisles; teams with joints of both kinds."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Literal

import numpy as np
import shapely
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from benchmarks.adversaries.collisions import Team
from coop_drake.answers import PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import FloatArray, PlanarPose
from coop_drake.verification.question import question_of

__all__ = ["random_question"]

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
