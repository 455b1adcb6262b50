"""Checks of a question, and questions derived from it: with other floors, fewer robots, another end."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache
from math import pi

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import ROUNDING, PlanningProblem, TeamLimits, at_goal, goal_box
from coop_drake.errors import GeometryError, PlanError
from coop_drake.geometry.minkowski import FreeSpace, components, to_polygon
from coop_drake.geometry.polygons import BoundaryDistance, parts_of, polygon_rings
from coop_drake.geometry.sweeps import normals
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Component, ComponentTree, TreeJoint, nearest_turn

# Checks of a question before the search: finite numbers of the right count, joints within their limits.


def check_question(problem: PlanningProblem) -> None:
    """Refuse a question without meaning.

    Raises:
        PlanError: Names the entry, its value and what is allowed.
    """
    joints = problem.tree.joints
    _check_numbers("start", problem.start, 3 + len(joints), "x, y, theta and every joint")
    _check_numbers("goal_pose", problem.goal_pose, 3, "x, y and theta")
    if len(problem.goal_joints) != len(joints):
        raise PlanError(
            f"goal_joints: {list(problem.goal_joints)} is not allowed; expected {len(joints)} entries, a "
            f"value or None for every joint"
        )
    if not np.isfinite(shapely.get_coordinates(problem.workspace)).all():
        raise PlanError("workspace: has corners that are not allowed; expected finite numbers")
    for joint in joints:
        endless = joint.circular and joint.kind == "revolute"
        if not (endless or -np.inf < joint.lower <= joint.upper < np.inf):
            raise PlanError(
                f"limits of {joint.name}: [{joint.lower}, {joint.upper}] are not allowed; expected two "
                f"finite limits, the lower one first, or none for a revolute joint, which is a circle then"
            )
        start, goal = float(problem.start[3 + joint.index]), problem.goal_joints[joint.index]
        if not _within(start, joint):
            raise PlanError(
                f"start: {start} of {joint.name} is not allowed; expected a value within its limits "
                f"[{joint.lower}, {joint.upper}]"
            )
        if goal is not None and not np.isfinite(goal):
            raise PlanError(f"goal_joints: {goal} of {joint.name} is not allowed; expected a finite number")


def goal_beyond_limits(problem: PlanningProblem) -> str | None:
    """A sentence that names a joint whose goal is beyond its limits by more than its tolerance, or None."""
    for joint, (low, high) in zip(problem.tree.joints, goal_box(problem)[1:], strict=True):
        if low > high:
            goal, limits = problem.goal_joints[joint.index], f"[{joint.lower}, {joint.upper}]"
            return (
                f"at the goal {joint.name} is {goal}, beyond its limits {limits} by more than its tolerance"
            )
    return None


def _check_numbers(key: str, values: FloatArray, count: int, names: str) -> None:
    if np.shape(values) != (count,) or not np.isfinite(values).all():
        raise PlanError(
            f"{key}: {np.asarray(values).tolist()} is not allowed; expected {count} finite numbers: {names}"
        )


def _within(value: float, joint: TreeJoint) -> bool:
    return joint.lower - ROUNDING <= value <= joint.upper + ROUNDING


# The part of a floor near some positions: what a team there may meet, and some more.

EXTRA_FLOOR = 1.0
"""The part of a floor near a path reaches this much further than the team [m]: wide cells are faster."""


def nearby(floor: Polygon | MultiPolygon, positions: FloatArray, reach: float) -> MultiPolygon:
    """The part of a floor that a team at some positions can touch, and ``EXTRA_FLOOR`` around it.

    Args:
        floor: Polygons with holes [m].
        positions: Positions p_WL, shape (k, 2) [m].
        reach: Distance of the team's furthest point from p_WL [m].
    """
    lower, upper = positions.min(axis=0) - reach - EXTRA_FLOOR, positions.max(axis=0) + reach + EXTRA_FLOOR
    return MultiPolygon(parts_of(floor.intersection(shapely.box(*lower, *upper))))


# Workspaces shrunk by a margin, except near a start or goal that stands close to a wall (rule 1).

SMALLEST_MARGIN = 0.005
"""Smaller margins are not tried: they are within the accuracy of a real floor [m]."""

_OCTAGON = normals(np.arange(0.5, 8.0, dtype=np.float64) * (pi / 4.0)) / np.cos(pi / 8.0)
"""Corners of a regular octagon about the unit disc, shape (8, 2) [-]."""
END_FRACTION = 0.2
"""Around a start or goal close to a wall the floor is shrunk by this fraction of its own clearance [-]."""

CLOSE_FACTOR = 1.1
"""A start or goal with less clearance than this many margins counts as close to a wall [-]."""

PATCH_FACTOR = 2.0
"""The floor around a start or goal that is shrunk less reaches this many margins beyond its footprint [-]."""

_REMEMBERED = 4
"""Floors at a margin, and questions with the clearances of their ends, that are remembered [-]."""

ARC_SEGMENTS = 32
"""Segments of a quarter circle in exact footprints: a disc's polygon is right to 3e-4 of its radius."""


def shrunk(workspace: Polygon, margin: float) -> MultiPolygon:
    """Shrink the workspace by the margin.

    The disc is replaced by an octagon around it, so slightly too much is removed.

    Raises:
        GeometryError: If geometry fails.
    """
    if margin <= 0.0:
        return MultiPolygon([workspace])
    section = FreeSpace(polygon_rings(workspace)).minus(disc_polygon(margin))
    parts = components(section, over=False)
    if not (parts or section.is_empty()):
        raise GeometryError(f"the floor at a margin of {margin} m cannot be parted")
    return MultiPolygon([to_polygon(part) for part in parts])


def disc_polygon(radius: float) -> FloatArray:
    """Octagon about a disc, shape (8, 2) [m]."""
    octagon: FloatArray = radius * _OCTAGON
    return octagon


@lru_cache(maxsize=_REMEMBERED)
def marginal_workspace(problem: PlanningProblem, margin: float) -> MultiPolygon:
    """Workspace shrunk by the margin, but less near a start or goal that stands close to a wall.

    There the floor around the footprint is shrunk by a fifth of the footprint's own clearance only, so that a
    start near a wall does not forbid a margin everywhere else. The last few are remembered: a search uses
    the same margins again and again.
    """
    result = shrunk(problem.workspace, margin)
    for footprint, clearance in _close_ends(problem, margin):
        own = shrunk(problem.workspace, END_FRACTION * clearance)
        patch = own.intersection(footprint.buffer(PATCH_FACTOR * margin, quad_segs=2))
        result = MultiPolygon(parts_of(shapely.union(result, patch)))
    return result


def _close_ends(problem: PlanningProblem, margin: float) -> list[tuple[BaseGeometry, float]]:
    """Footprints at start and goal that are too close to a wall for a margin, and their clearances [m]."""
    close = []
    for (configuration, some), bound in zip(_ends(problem), _end_clearances(problem), strict=True):
        if bound >= CLOSE_FACTOR * margin:
            continue
        footprint = exact_footprint(problem.tree, configuration, some)
        clearance = float(problem.workspace.boundary.distance(footprint))
        if clearance < CLOSE_FACTOR * margin and problem.workspace.contains(footprint):
            close.append((footprint, clearance))
    return close


@lru_cache(maxsize=_REMEMBERED)
def _end_clearances(problem: PlanningProblem) -> list[float]:
    """Clearances of the nearest pieces at start and goal [m]; most questions need no footprints."""
    placed = [_pieces(problem.tree, *end) for end in _ends(problem)]
    boundary = problem.workspace.boundary
    return [float((shapely.distance(boundary, pieces) - radii).min()) for pieces, radii in placed]


def _ends(problem: PlanningProblem) -> list[tuple[FloatArray, int | None]]:
    """Configurations at start and goal, and the number of components whose pose is known there.

    None stands for all. At the goal only the object's pose is known unless every joint has a goal.
    """
    joints = [0.0 if value is None else value for value in problem.goal_joints]
    free = any(value is None for value in problem.goal_joints)
    goal = np.array([*problem.goal_pose, *joints])
    return [(problem.start, None), (goal, 1 if free else None)]


def exact_footprint(
    tree: ComponentTree, configuration: FloatArray, components: int | None = None
) -> BaseGeometry:
    """Footprint of the first components at a configuration, eq. (3), with fine polygons for discs.

    Args:
        tree: The team.
        configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        components: Number of components to take; None for all.
    """
    pieces, radii = _pieces(tree, configuration, components)
    return shapely.union_all(shapely.buffer(pieces, radii, quad_segs=ARC_SEGMENTS))


def _pieces(
    tree: ComponentTree, configuration: FloatArray, components: int | None
) -> tuple[NDArray[np.object_], FloatArray]:
    """Hulls of the pieces of the first components at a configuration, and the radii they are grown by [m]."""
    chosen: list[Component] = list(tree.components[:components])
    placed = [
        (X_WC.apply(shape.vertices), shape.radius)
        for component, X_WC in zip(chosen, tree.poses(configuration), strict=False)
        for body in component.bodies
        for shape in body.shapes
    ]
    owners = np.repeat(np.arange(len(placed)), [len(vertices) for vertices, _ in placed])
    corners = shapely.multipoints(np.concatenate([vertices for vertices, _ in placed]), indices=owners)
    return np.asarray(shapely.convex_hull(corners)), np.array([radius for _, radius in placed])


# Relaxations: the same question with fewer robots or a disc; if one is infeasible, the question is too.


def relaxed(problem: PlanningProblem, robots: Collection[int]) -> tuple[PlanningProblem, tuple[int, ...]]:
    """The question with only some of the robots.

    Args:
        problem: The whole question.
        robots: Robots whose arms and bases are kept; bodies welded to the object are kept in any case.

    Returns:
        The relaxed question, and for each of its joints the index of that joint in the whole q.
    """
    tree = problem.tree
    kept = [
        index
        for index, component in enumerate(tree.components)
        if component.joint is None or component.joint.robot in robots
    ]
    joints = [joint.index for joint in tree.joints if joint.robot in robots]
    components = tuple(_renumbered(tree.components[index], kept, joints) for index in kept)
    question = replace(
        problem,
        tree=ComponentTree(components, tree.unchecked_pairs),
        start=np.concatenate((problem.start[:3], problem.start[3:][joints])),
        goal_joints=tuple(problem.goal_joints[index] for index in joints),
        joint_tolerance=np.broadcast_to(problem.joint_tolerance, len(tree.joints))[joints],
        limits=TeamLimits(),
    )
    return question, tuple(joints)


def _renumbered(component: Component, kept: list[int], joints: list[int]) -> Component:
    if component.joint is None or component.parent is None:
        return component
    joint = replace(component.joint, index=joints.index(component.joint.index))
    return replace(component, parent=kept.index(component.parent), joint=joint)


# The question of ending at one configuration of the goal.

SAME_END = 1e-9
"""Ends that differ by less in every axis are one end that was rounded [m, rad]."""


def ending_at(problem: PlanningProblem, end: FloatArray) -> PlanningProblem:
    """The question of ending at one configuration of the goal, with what the tolerances leave about it.

    Args:
        problem: The question.
        end: z, in the goal; what it says of joints without a goal does not matter, shape (3 + n,) [m, rad].

    Returns:
        The question; the same one if it is the middle of the goal.
    """
    goal = at_goal(problem.goal_pose, problem.goal_joints, end[3:])
    away = end - goal
    away[2:] = np.where(problem.tree.circular, [nearest_turn(angle) for angle in away[2:].tolist()], away[2:])
    away = np.abs(away)
    if away.max() <= SAME_END:
        return problem
    values = zip(problem.goal_joints, end[3:].tolist(), strict=True)
    return replace(
        problem,
        goal_pose=end[:3].copy(),
        goal_joints=tuple(None if goal is None else value for goal, value in values),
        position_tolerance=problem.position_tolerance - float(np.hypot(*away[:2])),
        angle_tolerance=problem.angle_tolerance - float(away[2]),
        joint_tolerance=problem.joint_tolerance - away[3:],
        roomy=False,
    )


def within_limits(problem: PlanningProblem) -> PlanningProblem:
    """The question with goals of joints that are beyond their limits moved to what these leave of them."""
    end = at_goal(problem.goal_pose, problem.goal_joints, 0.0)
    lower, upper = np.array(goal_box(problem))[1:].T.reshape(2, -1)
    known = np.array([goal is not None for goal in problem.goal_joints], dtype=bool)
    beyond = known & ((end[3:] < lower) | (end[3:] > upper))
    end[3:] = np.where(beyond, 0.5 * (lower + upper), end[3:])
    return ending_at(problem, end)


# Where a transport ends within its goal, if not in its middle: that is in collision, or beyond a limit.

LEAST_END_SHARE = 0.1
"""Share of a tolerance about an end that a cell leaves at least, so that a team can come to rest [-]."""

_END_FAN = (
    np.array([0.25, 0.5, 0.75])[:, None, None] * normals(np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False))
).reshape(-1, 2)
"""Positions within a tolerance of 1 that are tried, shape (48, 2) [-]."""


def end_in(problem: PlanningProblem, intervals: Intervals, boundary: BoundaryDistance) -> FloatArray | None:
    """A configuration of the goal in a cell that is free, its middle if possible; None if there is no room.

    Args:
        problem: The question.
        intervals: The cell's intervals of (theta, q...).
        boundary: Distance from the boundary of its positions.

    Returns:
        z, theta as in the intervals, joints without a goal in the middle of theirs, shape (3 + n,) [m, rad].
    """
    place, values = _place_in(problem, boundary), list[float]()
    goals, circular = (float(problem.goal_pose[2]), *problem.goal_joints), problem.tree.circular
    for (a, b), (low, high), goal, periodic in zip(
        intervals, goal_box(problem), goals, circular, strict=True
    ):
        middle = 0.5 * (a + b)
        if goal is None:
            values.append(middle)
            continue
        turns = middle + nearest_turn(goal - middle) - goal if periodic else 0.0
        lower, upper = max(a, low + turns), min(b, high + turns)
        if lower <= goal + turns <= upper:
            values.append(goal + turns)
        elif upper - lower >= LEAST_END_SHARE * (high - low) > 0.0:
            values.append(0.5 * (lower + upper))
    return None if place is None or len(values) < len(intervals) else np.array([*place, *values])


def _place_in(problem: PlanningProblem, boundary: BoundaryDistance) -> FloatArray | None:
    """The goal's position if it is held, else the one within the tolerance that has the most room."""
    goal, room = problem.goal_pose[:2], problem.position_tolerance
    depth = float(boundary.batch(goal[None])[0])
    if depth > 0.0:
        return goal
    if depth < -room:
        return None
    places = goal + room * _END_FAN
    left = np.minimum(boundary.batch(places), room - np.hypot(*(places - goal).T))
    best = int(np.argmax(left))
    return places[best] if left[best] >= LEAST_END_SHARE * room else None
