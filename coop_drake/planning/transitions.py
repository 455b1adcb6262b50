"""From a channel of free boxes to a plan: tidied cells, targets, goal intervals and gains, eqs. (10)-(12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, inf, isfinite, pi, sin, tau
from typing import Any

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.document import problem_digest
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.errors import GeometryError, PlanError, StallError
from coop_drake.geometry.passage import Passage, PassageFinder
from coop_drake.geometry.polygons import BoundaryDistance, component_at
from coop_drake.geometry.simplify import tidy_cell
from coop_drake.laws import GainSet, ScheduledGains, TransitionGains, transition_gains
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel, exits
from coop_drake.planning.duration import plan_time, timed, travel_time
from coop_drake.planning.limits import (
    GOAL_REGION_FRACTION,
    check_accelerations,
    limits_of,
    planned_accelerations,
    speed_shares,
    stated_speeds,
)
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import nearest_turn

# The ends of a channel: checked, turned to the start; and the goal intervals of each of its boxes.

GOAL_FRACTION = 0.9
"""Fraction of the goal's intervals that a plan ends in, so that it is within tolerance at their edges [-]."""

Bounds = tuple[FloatArray, FloatArray]
"""Lower and upper ends of (theta, q...), shape (1 + n,) each [rad, m]."""


def goal_values(problem: PlanningProblem, goal_angle: float, near: FloatArray) -> tuple[float | None, ...]:
    """Values of (theta, q...) at the goal, None for joints that are free there.

    Args:
        problem: What was asked.
        goal_angle: The goal's theta, unwrapped [rad].
        near: Values of (theta, q...) that the goals of joints without limits are turned to, shape (1 + n,).
    """
    joints = zip(problem.tree.joints, problem.goal_joints, near[1:].tolist(), strict=True)
    turned = (
        value + nearest_turn(goal - value) if joint.circular and goal is not None else goal
        for joint, goal, value in joints
    )
    return (goal_angle, *turned)


def final_intervals(problem: PlanningProblem, values: Sequence[float | None]) -> Bounds:
    """Intervals of (theta, q...) in which the goal is reached; infinite for joints that are free there.

    Args:
        problem: What was asked.
        values: The values there, see ``goal_values``.
    """
    goals = (float(problem.goal_pose[2]), *problem.goal_joints)
    lower, upper = np.full(len(goals), -inf), np.full(len(goals), inf)
    for axis, ((low, high), goal, value) in enumerate(zip(goal_box(problem), goals, values, strict=True)):
        if goal is not None and value is not None:
            spare, turned = 0.5 * (1.0 - GOAL_FRACTION) * (high - low), value - goal
            lower[axis], upper[axis] = low + spare + turned, high - spare + turned
    return lower, upper


def goal_intervals(problem: PlanningProblem, channel: Channel, index: int) -> Bounds:
    """Intervals of (theta, q...) to reach in a box: its overlap with the next box or with the goal.

    Raises:
        PlanError: If they do not overlap; names the box and the axis.
    """
    lower, upper = channel.boxes[index].lower.copy(), channel.boxes[index].upper.copy()
    if index + 1 < len(channel.boxes):
        following = channel.boxes[index + 1]
        lower, upper = np.maximum(lower, following.lower), np.minimum(upper, following.upper)
    else:
        goals = final_intervals(problem, goal_values(problem, channel.goal_angle, 0.5 * (lower + upper)))
        lower, upper = np.maximum(lower, goals[0]), np.minimum(upper, goals[1])
    if not (lower < upper).all():
        axis = int(np.argmin(lower < upper))
        other = "the next cell" if index + 1 < len(channel.boxes) else "the goal"
        raise PlanError(
            f"cell {index}: on axis {axis} it shares no interval with {other}: the larger lower end "
            f"{lower[axis]} is not below the smaller upper end {upper[axis]}"
        )
    return lower, upper


def turned_to_start(problem: PlanningProblem, channel: Channel) -> Channel:
    """Shift circular axes of all boxes by full turns so that the first one holds the start's angles."""
    first = channel.boxes[0]
    turns = np.rint((problem.start[2:] - 0.5 * (first.lower + first.upper)) / tau)
    shift = np.where(problem.tree.circular, turns * tau, 0.0)
    boxes = tuple(replace(box, lower=box.lower + shift, upper=box.upper + shift) for box in channel.boxes)
    path = None if channel.path is None else channel.path + np.concatenate([[0.0, 0.0], shift])
    return replace(channel, boxes=boxes, goal_angle=channel.goal_angle + shift[0], path=path)


def check_ends(problem: PlanningProblem, channel: Channel) -> None:
    """Refuse a channel whose first box does not hold the start, or whose last one does not hold the goal.

    Raises:
        PlanError: Names the end and the box.
    """
    first, last = channel.boxes[0], channel.boxes[-1]
    start, goal = problem.start[2:], channel.goal_angle
    if not first.polygon.contains(Point(problem.start[:2])):
        raise PlanError("the start's position lies outside the first cell")
    if not ((first.lower < start) & (start < first.upper)).all():
        raise PlanError(
            f"the start's angles {start} lie outside the first cell's [{first.lower}, {first.upper}]"
        )
    if not last.polygon.contains(Point(problem.goal_pose[:2])):
        raise PlanError("the goal's position lies outside the last cell")
    if not last.lower[0] <= goal <= last.upper[0]:
        raise PlanError(
            f"the goal's angle {goal} lies outside the last cell's [{last.lower[0]}, {last.upper[0]}]"
        )


# A path through the boxes of a channel that was found without one.


def path_through(problem: PlanningProblem, channel: Channel) -> FloatArray:
    """A path along the widest passages of a channel's boxes; angles move evenly from overlap to overlap.

    Args:
        problem: What was asked.
        channel: The boxes, theta turned to the start.

    Returns:
        Free configurations from start to goal, circular axes unwrapped, shape (m, 3 + n).
    """
    targets = (*exits(channel), problem.goal_pose[:2])
    samples, axes = [problem.start], problem.start[2:]
    entries = (problem.start[:2], *targets[:-1])
    for index, (box, entry, target) in enumerate(zip(channel.boxes, entries, targets, strict=True)):
        lower, upper = goal_intervals(problem, channel, index)
        aim = 0.5 * (lower + upper)
        if index + 1 == len(channel.boxes):
            goals = goal_values(problem, channel.goal_angle, aim)
            nearest = np.clip(axes, lower, upper)
            aim = np.array(
                [near if goal is None else goal for near, goal in zip(nearest, goals, strict=True)]
            )
        corners = shapely.get_coordinates(PassageFinder(box.polygon).find(entry, target).path)
        at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        fractions = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(at))
        turned = axes + fractions[1:, None] * (aim - axes)
        samples += list(np.hstack((corners[1:], turned)))
        axes = aim
    return np.array(samples)


DISC_VERTICES = 32
"""Vertices of the last goal region, a polygon inside the disc of the position tolerance."""

SAME_PLACE = 1e-9
"""A target this close to where its cell is entered leaves only angles to move [m]: it absorbs rounding."""


def make_plan(
    problem: PlanningProblem,
    channel: Channel,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    targets: Sequence[FloatArray] | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Make a plan of a channel.

    Args:
        problem: What was asked.
        channel: Free boxes from start to goal.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        targets: Points at which each box is left, the last one the goal; by default as ``exits`` has them.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
    """
    channel = turned_to_start(problem, channel)
    start, goal = problem.start[:2], problem.goal_pose[:2]
    check_ends(problem, channel)
    if targets is None:
        targets = (*exits(channel), goal)
    entries = (start, *targets[:-1])
    cells = []
    for index, (box, entry, target) in enumerate(zip(channel.boxes, entries, targets, strict=True)):
        cells.append(_cell(box, entry, target, index))
        if progress is not None:
            progress("tidying", (index + 1) / len(targets))
    routes, transitions, resting = [], [], problem.start[2:]
    for index, (entry, target) in enumerate(zip(entries, targets, strict=True)):
        goals = goal_intervals(problem, channel, index)
        routes.append(find_route(problem, cells[index : index + 2], entry, target, index))
        transitions.append(_transition(gain_set, cells[index], routes[-1], goals, resting))
        resting = 0.5 * (goals[0] + goals[1])
    made = Plan(
        cells=tuple(cells),
        transitions=tuple(transitions),
        start=problem.start.copy(),
        goal_pose=np.array([*goal, channel.goal_angle]),
        goal_joints=goal_values(problem, channel.goal_angle, resting)[1:],
        joint_names=tuple(joint.name for joint in problem.tree.joints),
        gain_set=gain_set_name,
        problem=problem_digest(problem),
    )
    if problem.passes:  # The motion through the cells keeps the limits, and takes time.
        return made
    return _checked(problem, keep_limits(problem, timed(made), gain_set), routes)


def keep_limits(problem: PlanningProblem, plan: Plan, gain_set: GainSet) -> Plan:
    """Return a plan that keeps all limits, the quickest of a few ways to share speeds among the axes.

    Args:
        problem: What was asked, with the limits.
        plan: A plan with the gains of the gain set, without limits.
        gain_set: Gains, fixed or to be scheduled.

    Raises:
        TooQuickError: In the estimated transport a limit of acceleration acts; names the joint.
    """
    most = planned_accelerations(problem.limits)
    if most is not None:
        plan = timed(with_gains(plan, gain_set, plan.gain_set, accelerations=most))
    if problem.limits.any:
        plan = share_speeds(problem, plan, gain_set)
    if most is not None:
        check_accelerations(plan, most)
    return plan


def share_speeds(problem: PlanningProblem, plan: Plan, gain_set: GainSet) -> Plan:
    """Return a plan that keeps the limits of speed, the quickest of a few ways to share them among the axes.

    Args:
        problem: What was asked, with limits of speed.
        plan: A plan with the gains of the gain set.
        gain_set: Gains, fixed or to be scheduled.
    """
    tried = []
    for shares in speed_shares(problem, plan):
        limited = timed(with_gains(plan, gain_set, plan.gain_set, shares))
        tried.append(replace(limited, speeds=stated_speeds(problem, shares)))
    return min(tried, key=plan_time)


def reschedule(plan: Plan, gain_set: GainSet, name: str) -> Plan:
    """A plan with the gains of another gain set, and with times estimated anew; see ``with_gains``."""
    return timed(with_gains(plan, gain_set, name))


def with_gains(
    plan: Plan,
    gain_set: GainSet,
    name: str,
    limits: FloatArray | None = None,
    accelerations: FloatArray | None = None,
) -> Plan:
    """A plan with the gains of another gain set; its estimated times are kept.

    Args:
        plan: The plan.
        gain_set: Gains, fixed or to be scheduled.
        name: Name under which the scenario knows them.
        limits: Largest speed of the object and rates of all axes, shape (2 + n,); those of the plan if None.
        accelerations: Largest accelerations of all axes, shape (1 + n,); those of the plan if None.
    """
    if isinstance(gain_set, ScheduledGains):
        gain_set = gain_set.slowed(plan.age_factor)
    resting, limits = plan.start[2:], limits_of(plan) if limits is None else limits
    transitions = []
    for cell, transition in zip(plan.cells, plan.transitions, strict=True):
        goals = (transition.goal_lower, transition.goal_upper)
        most = transition.gains.acceleration_limit if accelerations is None else accelerations
        gains = _gains(gain_set, cell, transition.neck, goals, resting, limits, most)
        transitions.append(replace(transition, gains=gains))
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    return replace(plan, transitions=tuple(transitions), gain_set=name)


@dataclass(frozen=True)
class Route:
    """The positions of one transition: its target with the room around it, and its passage."""

    target: FloatArray
    inradius: float
    passage: Passage

    @property
    def passage_fields(self) -> dict[str, Any]:
        """What a transition states about its passage."""
        return {
            "path": shapely.get_coordinates(self.passage.path),
            "neck": self.passage.clearance,
            "length": self.passage.length,
            "only_angles": bool(self.passage.length <= SAME_PLACE),
        }


def find_route(
    problem: PlanningProblem, cells: Sequence[Cell], entry: FloatArray, target: FloatArray, index: int
) -> Route:
    """Return the route from entry to target in the first cell; the second one, if any, is entered there.

    Args:
        problem: What was asked.
        cells: The cell, and the next one if there is one.
        entry: Where the cell is entered, shape (2,) [m].
        target: Where it is left, shape (2,) [m].
        index: Index of the cell, for messages.

    Raises:
        GeometryError: The cell does not join them.
        StallError: The passage or the room around the target is too narrow.
    """
    here = cells[0].tidied
    if len(cells) > 1:
        region = component_at(here.intersection(cells[1].tidied), Point(target))
    else:
        region = component_at(_disc(target, problem.position_tolerance).intersection(here), Point(target))
    inradius = 0.0 if region.is_empty else BoundaryDistance(region)(target)
    route = Route(target, inradius, PassageFinder(here).find(entry, target))
    least = wanted = problem.settings.min_clearance
    if len(cells) == 1:
        wanted = min(least, GOAL_REGION_FRACTION * problem.position_tolerance)
    if inradius < wanted or route.passage.clearance < least:
        seconds = travel_time(route.passage.length, route.passage.clearance)
        raise StallError(_stall(problem, index, route, seconds, "min_clearance"))
    return route


def _checked(problem: PlanningProblem, plan: Plan, routes: Sequence[Route]) -> Plan:
    """The plan; raises a StallError if one of its estimated times is too long."""
    for index, (route, transition) in enumerate(zip(routes, plan.transitions, strict=True)):
        if transition.estimated_time > problem.settings.max_transition_time:
            seconds = transition.estimated_time
            raise StallError(_stall(problem, index, route, seconds, "max_transition_time"))
    return plan


def _transition(
    gain_set: GainSet, cell: Cell, route: Route, goals: Bounds, resting: FloatArray
) -> Transition:
    """A transition without its estimated time."""
    return Transition(
        target=route.target,
        goal_lower=goals[0],
        goal_upper=goals[1],
        inradius=route.inradius,
        estimated_time=0.0,
        **route.passage_fields,
        gains=_gains(gain_set, cell, route.passage.clearance, goals, resting),
    )


def _stall(problem: PlanningProblem, index: int, route: Route, seconds: float, refused_by: str) -> str:
    """Return what is refused, and by which setting."""
    passage, settings = route.passage, problem.settings
    x, y = passage.narrowest
    return (
        f"cell {index} is refused by planner.{refused_by}: the object's passage through ({x:.3f}, {y:.3f}) "
        f"is {2e3 * passage.clearance:.1f} mm wide and {passage.length:.2f} m long, about {seconds:.0f} s, "
        f"and its target ({route.target[0]:.3f}, {route.target[1]:.3f}) has {1e3 * route.inradius:.1f} mm "
        f"around it; expected at least {2e3 * settings.min_clearance:g} mm and "
        f"{1e3 * settings.min_clearance:g} mm, and at most {settings.max_transition_time:.0f} s"
    )


def _cell(box: FreeBox, entry: FloatArray, target: FloatArray, index: int) -> Cell:
    try:
        tidied = tidy_cell(box.polygon, (entry, target))
    except GeometryError as error:
        raise StallError(f"cell {index}: {error}") from error
    return Cell(box.lower, box.upper, tidied)


def _gains(
    gain_set: GainSet,
    cell: Cell,
    clearance: float,
    goal: Bounds,
    resting: FloatArray,
    limits: FloatArray | None = None,
    accelerations: FloatArray | None = None,
) -> TransitionGains:
    speed = None if limits is None or not isfinite(limits[0]) else float(limits[0])
    return transition_gains(
        gain_set,
        clearance=clearance,
        slice_lower=cell.lower,
        slice_upper=cell.upper,
        goal_lower=goal[0],
        goal_upper=goal[1],
        resting=resting,
        speed_limit=speed,
        rate_limit=None if limits is None else limits[1:],
        acceleration_limit=accelerations,
    )


def _disc(centre: FloatArray, radius: float) -> Polygon:
    angles = [2.0 * pi * k / DISC_VERTICES for k in range(DISC_VERTICES)]
    return Polygon([(centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)) for angle in angles])
