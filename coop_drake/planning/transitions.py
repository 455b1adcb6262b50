"""From a channel of free boxes to a plan: tidied cells, targets, goal intervals and gains, eqs. (10)-(12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, isfinite, pi, sin
from typing import Any

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, StallError
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.parts import component_at
from coop_drake.geometry.passage import Passage, PassageFinder
from coop_drake.geometry.tidy import tidy_cell
from coop_drake.laws import GainSet, ScheduledGains, TransitionGains, transition_gains
from coop_drake.planning.boxes.channel import Channel, FreeBox
from coop_drake.planning.execution.acceleration_limits import check_accelerations, planned_accelerations
from coop_drake.planning.execution.channel_ends import (
    Bounds,
    check_ends,
    goal_intervals,
    goal_values,
    turned_to_start,
)
from coop_drake.planning.execution.estimate import plan_time, timed
from coop_drake.planning.execution.refusals import GOAL_REGION_FRACTION
from coop_drake.planning.execution.speed_shares import limits_of, speed_shares, stated_speeds
from coop_drake.planning.execution.targets import targets_of
from coop_drake.planning.travel_time import travel_time
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray

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
        targets: Points at which each box is left, the last one the goal; chosen if not given.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
    """
    channel = turned_to_start(problem, channel)
    start, goal = problem.start[:2], problem.goal_pose[:2]
    check_ends(problem, channel)
    if targets is None:
        targets = targets_of(channel, start, goal)
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


def share_speeds(problem: PlanningProblem, plan: Plan, gain_set: GainSet, spare_rate: float = 0.0) -> Plan:
    """Return a plan that keeps the limits of speed, the quickest of a few ways to share them among the axes.

    Args:
        problem: What was asked, with limits of speed.
        plan: A plan with the gains of the gain set.
        gain_set: Gains, fixed or to be scheduled.
        spare_rate: What the rate of every axis may exceed the estimate by, for instance as its budget lets it
            depart from its nominal motion [rad/s or m/s].
    """
    tried = []
    for shares in speed_shares(problem, plan, spare_rate):
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
    """A plan with the gains of another gain set, without a budget; its estimated times are kept.

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
        transitions.append(replace(transition, gains=gains, tolerance=None, governed=None))
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    made = replace(plan, transitions=tuple(transitions), gain_set=name)
    return replace(made, budget=None, tube=None, axis_tracking=None)


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
