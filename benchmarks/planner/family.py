"""Questions of growing size: corridors, teams and warehouses made from a few numbers."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, pi, sqrt

import numpy as np
from shapely import Polygon, affinity, box, normalize, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint

_JOINT_LIMIT = 1.87
"""Joints move between minus and plus this angle, as in the paper [rad]."""
_BASE_RADIUS = 0.25
"""Radius of a robot's base [m]."""
_FOREARM = 0.35
"""Distance of the base's centre from the joint next to it [m]."""
_HALF_LINK = 0.05
"""Half the width of a link [m]."""
_BAR = ((0.4, 0.0, 0.0), (-0.4, 0.0, pi), (0.0, 0.25, pi / 2), (0.0, -0.25, -pi / 2))
"""Grasps (x, y, angle) of the carried bar of 0.8 m x 0.5 m [m, rad]."""
_BAR_REACH = (0.4, 0.4, 0.25, 0.25)
"""Distance of the innermost joint from each grasp [m]."""
_START_X = {1: 0.9, 2: 0.9, 3: 1.6, 4: 1.3}
"""Start position x by the number of robots, where the start room is wide enough [m]."""
_HEXAGON_APOTHEM = 0.4
"""Distance of the hexagon's sides from its centre [m]."""
_HEXAGON_TURNS = (0, 3, 1, 4, 2, 5)
"""Facets of the hexagon in the order in which robots take hold of them."""
_AISLE = 1.8
"""Width of the aisles between shelves [m]."""
_SHELF = (1.2, 2.4)
"""Size of a shelf [m]."""


def first_question() -> PlanningProblem:
    """A short carry across an empty room: answered at once, with every compiled kernel called."""
    return replace(
        corridor_problem(), workspace=box(-3.0, -3.0, 5.0, 6.0), goal_pose=np.array([1.5, 2.5, 1.2])
    )


def corridor_floor(width: float, door: float, *, wide_start: bool = False) -> Polygon:
    """Two rooms, a corridor with a bend, a hall with clutter, and a doorway.

    Args:
        width: Width of the corridor [m].
        door: Width of the doorway [m].
        wide_start: Whether the start room is wide enough for robots at the sides of the object.
    """
    room, hall = (2.6, 3.4) if wide_start else (1.8, 3.0)
    open_floor = union_all(
        [
            box(0.0, 0.0, room, 3.6),
            box(0.3, 3.5, 0.3 + width, 6.4),
            box(0.3, 6.4 - width, 3.5, 6.4),
            box(hall, 2.4, 7.0, 6.4),
            box(5.0 - door / 2, 6.3, 5.0 + door / 2, 6.9),
            box(3.4, 6.8, 6.6, 10.0),
        ]
    )
    wedge = Polygon([(4.6, 2.4), (5.2, 2.4), (4.9, 2.9)])
    clutter = union_all([box(6.0, 2.4, 7.0, 3.4), wedge, box(3.9, 9.5, 4.3, 9.8)])
    return _one_floor(open_floor.difference(clutter))


def corridor_problem(
    width: float = 1.2, door: float = 1.2, robots: int = 2, joints_per_arm: int = 1
) -> PlanningProblem:
    """Carry the bar from the start room to the goal room; joints are free at the goal."""
    grasps = [PlanarPose(*grasp) for grasp in _BAR[:robots]]
    bar = ConvexShape(np.array([[-0.4, -0.25], [0.4, -0.25], [0.4, 0.25], [-0.4, 0.25]]))
    return _problem(
        corridor_floor(width, door, wide_start=robots > 2),
        team_tree(bar, grasps, _BAR_REACH[:robots], joints_per_arm),
        (_START_X[robots], 2.0, 1.57),
        (5.0, 8.0, 4.663),
    )


def crowd_problem(robots: int, width: float = 2.6, door: float = 3.0) -> PlanningProblem:
    """Carry a hexagon with two to six robots across the same floor, twice as large.

    Args:
        robots: How many of the six facets are held.
        width: Width of the corridor [m].
        door: Width of the doorway [m].
    """
    angles = np.array(_HEXAGON_TURNS[:robots]) * pi / 3
    corners = (np.arange(6) - 0.5) * pi / 3
    vertices = _HEXAGON_APOTHEM / np.cos(pi / 6) * np.column_stack((np.cos(corners), np.sin(corners)))
    grasps = [
        PlanarPose(_HEXAGON_APOTHEM * float(np.cos(a)), _HEXAGON_APOTHEM * float(np.sin(a)), float(a))
        for a in angles
    ]
    floor = corridor_floor(0.5 * width, 0.5 * door, wide_start=True)
    floor = affinity.scale(floor, 2.0, 2.0, origin=(0.0, 0.0))
    tree = team_tree(ConvexShape(vertices), grasps, (0.4,) * robots, 1)
    return _problem(floor, tree, (3.2, 4.0, 1.57), (10.0, 16.0, 4.663))


def shelf_floor(vertices: int) -> Polygon:
    """A rectangular floor with rows of shelves between aisles.

    Args:
        vertices: About how many corners the floor has: four for its outer ring and four for each shelf.
    """
    shelves = max(1, round((vertices - 4) / 4))
    columns = ceil(sqrt(shelves))
    rows = ceil(shelves / columns)
    pitch_x, pitch_y = _SHELF[0] + _AISLE, _SHELF[1] + _AISLE
    holes = [
        box(x, y, x + _SHELF[0], y + _SHELF[1])
        for number in range(shelves)
        for x, y in [(_AISLE + number % columns * pitch_x, _AISLE + number // columns * pitch_y)]
    ]
    outer = box(0.0, 0.0, _AISLE + columns * pitch_x, _AISLE + rows * pitch_y)
    return _one_floor(Polygon(outer.exterior, [hole.exterior for hole in holes]))


def shelf_problem(vertices: int) -> PlanningProblem:
    """Carry the bar with two robots from the first aisle to the last one, at the opposite corner."""
    floor = shelf_floor(vertices)
    _, _, x, y = floor.bounds
    bar = corridor_problem()
    start = (_AISLE / 2, _AISLE / 2 + 1.5, pi / 2)
    return _problem(floor, bar.tree, start, (x - _AISLE / 2, y - _AISLE / 2 - 1.5, pi / 2))


def team_tree(
    carried: ConvexShape, grasps: list[PlanarPose], reaches: tuple[float, ...], joints_per_arm: int
) -> ComponentTree:
    """The object, and for each grasp an arm of equal links that ends in a forearm with a round base.

    Args:
        carried: The object's outline in its own frame.
        grasps: Where robots hold it, x pointing outwards.
        reaches: Distance from each grasp to the robot's innermost joint, if the arm has one joint; arms
            with more joints divide it among as many links [m].
        joints_per_arm: Revolute joints of each robot, numbered from its base outwards.
    """
    links = [reach / joints_per_arm for reach in reaches]
    grips = [
        Body(f"robot_{k}::grip", k, (_placed(_bar(-0.02, length), grasp),))
        for k, (grasp, length) in enumerate(zip(grasps, links, strict=True))
    ]
    components = [Component("object", None, None, (Body("object", None, (carried,)), *grips))]
    sharing: set[tuple[str, str]] = set()
    for k, (grasp, length) in enumerate(zip(grasps, links, strict=True)):
        parent, before, X_PJ = 0, grips[k].name, grasp @ PlanarPose(length)
        for place in reversed(range(joints_per_arm)):
            bodies = (
                _forearm(k) if place == 0 else (Body(f"robot_{k}::link_{place}", k, (_bar(0.0, length),)),)
            )
            index = joints_per_arm * k + place
            limits = (-_JOINT_LIMIT, _JOINT_LIMIT)
            joint = TreeJoint(
                f"robot_{k}::joint_{place}", "revolute", k, index, X_PJ, -1.0, (1.0, 0.0), *limits
            )
            components.append(Component(bodies[0].name, parent, joint, bodies))
            sharing.add((bodies[0].name, before))
            parent, before, X_PJ = len(components) - 1, bodies[0].name, PlanarPose(length)
    return ComponentTree(tuple(components), frozenset(sharing))


def _forearm(k: int) -> tuple[Body, Body]:
    base = ConvexShape(np.array([[_FOREARM, 0.0]]), _BASE_RADIUS)
    return Body(f"robot_{k}::forearm", k, (_bar(0.0, _FOREARM),)), Body(f"robot_{k}::base", k, (base,))


def _bar(x_lower: float, x_upper: float) -> ConvexShape:
    corners = [(x_lower, -1.0), (x_upper, -1.0), (x_upper, 1.0), (x_lower, 1.0)]
    return ConvexShape(np.array(corners) * (1.0, _HALF_LINK))


def _placed(shape: ConvexShape, X_PC: PlanarPose) -> ConvexShape:
    return ConvexShape(X_PC.apply(shape.vertices), shape.radius)


def _one_floor(floor: BaseGeometry) -> Polygon:
    tidy = normalize(floor.simplify(0.0))
    assert isinstance(tidy, Polygon)
    return tidy


def _problem(
    floor: Polygon,
    tree: ComponentTree,
    start: tuple[float, float, float],
    goal: tuple[float, float, float],
) -> PlanningProblem:
    joints = len(tree.joints)
    start_configuration: FloatArray = np.array([*start, *[0.0] * joints])
    return PlanningProblem(floor, tree, start_configuration, np.array(goal), (None,) * joints)
