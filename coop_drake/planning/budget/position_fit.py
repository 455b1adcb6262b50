"""A plan whose position holds under a budget: gains of its loop, and cells without their outer strip.

The object stays within r of its nominal motion, which the governor keeps in a region whose points are so far
from the boundary of the cell that monitors see in time whether it does. Targets, paths and clearances are
chosen again in these regions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, sqrt

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon

from coop_drake.answers.budget import Budget, PositionTube
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, StallError
from coop_drake.geometry.passage import pole
from coop_drake.geometry.polygons import BoundaryDistance, component_at, parts_of
from coop_drake.geometry.simplify import tidy_cell
from coop_drake.laws import ScheduledGains
from coop_drake.planning.duration import plan_time, timed
from coop_drake.planning.transitions import find_route
from coop_drake.robustness.alarms import alarms_of, position_room, rubbed
from coop_drake.robustness.position import PositionGains, position_tubes
from coop_drake.tree.arrays import FloatArray

SPEEDS = (2.0, 1.6, 1.3, 1.0, 0.7, 0.5, 0.35, 0.2)
"""Largest speeds of p_G that are tried, in this order [m/s]: slow motions have narrow tubes, and take small
forces."""

SOFTER = (1.0, 0.6, 0.35)
"""K over the largest of the gain set's that are tried [-]: a soft governor takes smaller forces."""

QUICK = 1.0
"""With at least this largest speed no softer governor is tried [m/s]: it would hardly be quicker."""

TRACKING_STIFFNESSES = (50.0, 100.0, 150.0, 250.0, 400.0, 600.0)
"""K_t that are tried [1/s^2]; the narrowest tube is taken. Stiffer loops follow the noise more than they
narrow the tube."""

TRACKING_DAMPINGS = (1.4, 1.7, 2.0)
"""zeta_t over the root of K_t that are tried [-]: 2 is critical damping, 1.4 a damping ratio of 0.7.
Which has the narrower tube depends on how noisy velocities are beside positions."""

MITRE_LIMIT = 2.0
"""Longest mitre over r where a strip is taken off a cell [-]; corners of walls that are sharper are cut off
farther away."""

OPENING = 0.25
"""A region counts as tidy if an opening by this share of its passage's clearance takes off less than two
squares of that size [-], the tip of one sharp corner: tidying opens cells by twice as much."""

KEPT = 0.6
"""A target is kept if its clearance in the regions is this share of the largest there [-]."""

SMALLEST_SHARE = 0.05
"""Share of the goal's tolerance that must be left for the nominal motion to arrive in [-]."""

GAP = 1e-6
"""The strip is wider than its monitors need by this [m], more than rounding."""


@dataclass(frozen=True)
class UnprovedPosition:
    """Why a budget cannot be shown to hold for the position.

    Attributes:
        reason: What cannot be shown, in words.
        whatever_cells: Whether it cannot be shown with other cells, either.
    """

    reason: str
    whatever_cells: bool = False


_UNSTABLE = UnprovedPosition(
    "the object's position is not stable under the delay, the lag and the model's error", whatever_cells=True
)


def fit_position(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget, most: float = inf
) -> Plan | UnprovedPosition:
    """Choose gains and regions with which the object's position holds under a budget, the quickest that do.

    Args:
        problem: What was asked.
        plan: A plan with the gains of the gain set.
        gain_set: The rule of its gains.
        budget: The departures to be tolerated.
        most: Largest acceleration that robots may command for the object's origin [m/s^2].

    Returns:
        The plan with the budget, the tube and these regions; or what cannot be shown.
    """
    stiffest = max(transition.gains.stiffness for transition in plan.transitions)
    own, tried = rubbed(budget, plan.axis_tracking), list[Plan | UnprovedPosition]()
    plan = replace(plan, budget=budget)
    for share in SOFTER:
        tried.append(_fastest(problem, plan, gain_set, own, share * stiffest, most))
        last = tried[-1]
        if isinstance(last, Plan) and last.tube is not None and last.tube.speed >= QUICK:
            break
    plans = [found for found in tried if isinstance(found, Plan)]
    return min(plans, key=plan_time) if plans else tried[0]


def unproved_position(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget
) -> UnprovedPosition | None:
    """Return why no tube is allowed whatever the cells are, None if one is; see ``fit_position``."""
    stiffest = max(transition.gains.stiffness for transition in plan.transitions)
    slowest = []
    for share in SOFTER:
        tubes = _tubes(share * stiffest, gain_set, budget)
        found = [_narrowest_allowed(of_speed, problem, plan) for of_speed in tubes]
        limits = [one for one in found if isinstance(one, UnprovedPosition)]
        if len(limits) < len(found):
            return None
        slowest += limits[-1:]
    return replace(slowest[0] if slowest else _UNSTABLE, whatever_cells=True)


def commanded_accelerations(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget
) -> list[float]:
    """Return the accelerations that robots may command for the object's origin, the largest first [m/s^2].

    They are those of all speeds of p_G, and of softer governors below the least of these.
    """
    stiffest = max(transition.gains.stiffness for transition in plan.transitions)
    found = list[float]()
    for share in SOFTER:
        tubes = [
            _narrowest_allowed(some, problem, plan) for some in _tubes(share * stiffest, gain_set, budget)
        ]
        least = min(found, default=inf)
        found += [t.acceleration for t in tubes if isinstance(t, PositionTube) and t.acceleration < least]
    return sorted(set(found), reverse=True)


def _fastest(
    problem: PlanningProblem,
    plan: Plan,
    gain_set: ScheduledGains,
    budget: Budget,
    stiffness: float,
    most: float,
) -> Plan | UnprovedPosition:
    """Return a plan with one K for all transitions, and a speed of p_G that is quicker than a slower one.

    Slow motions have narrow tubes, and so wide regions, in which p_G keeps its speed.
    """
    uniform, best = _with_stiffness(plan, stiffness, gain_set), None
    found: Plan | UnprovedPosition = _UNSTABLE
    for tubes in _tubes(stiffness, gain_set, budget):
        tube = _narrowest_allowed(tubes, problem, uniform, most)
        if isinstance(tube, UnprovedPosition):
            found = tube
            continue
        found = _within(problem, uniform, tube, position_room(budget, tube))
        if isinstance(found, UnprovedPosition):
            continue
        alarms = alarms_of(budget, tube)
        found = timed(replace(found, alarms=alarms))
        if best is not None and plan_time(best) <= plan_time(found):
            break
        best = found
    return best or found  # of the slowest motion, which has the narrowest tube


@lru_cache(maxsize=16)
def _tubes(
    stiffness: float, gain_set: ScheduledGains, budget: Budget
) -> tuple[tuple[PositionTube, ...], ...]:
    """Return the tubes of all gains for each speed of p_G with which a loop is stable, the least room first.

    They are needed again where the axes have been fitted.
    """
    damping = gain_set.damping_factor * sqrt(stiffness)
    choices = [
        PositionGains(stiffness, damping, tracking, factor * sqrt(tracking), speed)
        for speed in SPEEDS
        for tracking in TRACKING_STIFFNESSES
        for factor in TRACKING_DAMPINGS
    ]
    stable = [tube for tube in position_tubes(choices, budget) if tube is not None]
    of_speed = ([tube for tube in stable if tube.speed == speed] for speed in SPEEDS)
    return tuple(
        tuple(sorted(tubes, key=lambda tube: position_room(budget, tube))) for tubes in of_speed if tubes
    )


def _narrowest_allowed(
    tubes: Sequence[PositionTube], problem: PlanningProblem, plan: Plan, most: float = inf
) -> PositionTube | UnprovedPosition:
    """Return the narrowest tube that is allowed, or why none is; stiffer loops would take larger forces."""
    found = _not_allowed(tubes[0], problem, plan, most)
    allowed = (tube for tube in tubes if _not_allowed(tube, problem, plan, most) is None)
    return tubes[0] if found is None else next(allowed, found)


def _not_allowed(
    tube: PositionTube, problem: PlanningProblem, plan: Plan, most: float
) -> UnprovedPosition | None:
    """Return what the tube itself does not allow: a speed, a rest too far from the goal, an acceleration."""
    fastest = plan.transitions[0].gains.speed_limit
    if fastest is not None and tube.velocity > fastest:
        return UnprovedPosition(
            f"the object may be as fast as {tube.velocity:.2f} m/s; its limit is {fastest:.2f} m/s"
        )
    if tube.rest > (1.0 - SMALLEST_SHARE) * problem.position_tolerance:
        allowed = (1.0 - SMALLEST_SHARE) * problem.position_tolerance
        return UnprovedPosition(
            f"the object may rest {1e3 * tube.rest:.1f} mm from the goal; the goal's tolerance allows "
            f"{1e3 * allowed:.1f} mm"
        )
    if tube.acceleration > most:
        return UnprovedPosition(
            f"robots may command {tube.acceleration:.1f} m/s^2 for the object's origin; their limits of "
            f"efforts leave {most:.1f} m/s^2"
        )
    return None


def _with_stiffness(plan: Plan, stiffness: float, gain_set: ScheduledGains) -> Plan:
    """Return a plan with one K, zeta and K_G for all transitions, so that its loop does not vary in time."""
    root = sqrt(stiffness)
    own = stiffness, gain_set.damping_factor * root, gain_set.governor_factor * root
    transitions = tuple(
        replace(transition, gains=transition.gains.with_governor(*own)) for transition in plan.transitions
    )
    return replace(plan, transitions=transitions)


def _within(problem: PlanningProblem, plan: Plan, tube: PositionTube, room: float) -> Plan | UnprovedPosition:
    """Return a plan whose regions, targets and paths leave room for the tube; or where there is none.

    Args:
        problem: What was asked.
        plan: The plan.
        tube: The tube.
        room: How far the object may be off its nominal position before its monitors see it [m].
    """
    regions, targets = [], []
    strips = _grown([cell.tidied for cell in plan.cells], np.array(-(room + GAP)))
    entry: FloatArray = plan.start[:2]
    for k, transition in enumerate(plan.transitions):
        region, last = component_at(strips[k], Point(entry)), k + 1 == len(plan.cells)
        target = transition.target if last else _target(region, strips[k + 1], transition)
        if target is None or not region.contains(Point(target)):
            return _no_room(k, tube, room)
        regions.append(region)
        targets.append(target)
        entry = target
    entries = (plan.start[:2], *targets[:-1])
    cells = []
    for k, is_tidy in enumerate(_are_tidy(regions, plan)):
        try:
            tidied = regions[k] if is_tidy else tidy_cell(regions[k], (entries[k], targets[k]))
        except GeometryError:
            return _no_room(k, tube, room)
        cells.append(replace(plan.cells[k], tidied=tidied))
    transitions = []
    for k, transition in enumerate(plan.transitions):
        made = _routed(problem, cells[k : k + 2], entries[k], targets[k], transition, k)
        if made is None:
            return _no_room(k, tube, room)
        transitions.append(made)
    return replace(plan, transitions=tuple(transitions), tube=tube)


def _grown(shapes: Sequence[Polygon] | NDArray[np.object_], width: FloatArray) -> NDArray[np.object_]:
    """Return shapes that are wider by these widths along their boundaries, or narrower by negative ones."""
    return np.asarray(shapely.buffer(shapes, width, join_style="mitre", mitre_limit=MITRE_LIMIT))


def _are_tidy(regions: Sequence[Polygon], plan: Plan) -> NDArray[np.bool_]:
    """Return whether regions have no spurs or sharp corners that would have to be cut off.

    A cell that is tidied without an outer strip nearly always is tidy again: an opening with a part of its
    passage's clearance takes off hardly anything. Tidying takes several times as long as this test.
    """
    depth = np.array([OPENING * transition.neck for transition in plan.transitions])
    opened = _grown(_grown(regions, -depth), depth)
    return np.asarray(shapely.area(regions) - shapely.area(opened) < 2.0 * depth * depth)


def _no_room(k: int, tube: PositionTube, room: float) -> UnprovedPosition:
    return UnprovedPosition(
        f"in transition {k} the object may depart from its nominal motion by {1e3 * tube.radius:.1f} mm, and "
        f"by {1e3 * room:.1f} mm before its monitors see that it departs farther, more than the cell leaves"
    )


def _target(region: Polygon, following: Polygon, transition: Transition) -> FloatArray | None:
    """Return the target of a transition, or another one if it would be too near to the regions' boundary."""
    parts = parts_of(region.intersection(following))
    if not parts:
        return None
    best, clearance = max((pole(part) for part in parts), key=lambda found: found[1])
    own = next((part for part in parts if part.contains(Point(transition.target))), None)
    if own is not None and BoundaryDistance(own)(transition.target) >= KEPT * clearance:
        return transition.target
    return np.asarray(best)


def _routed(
    problem: PlanningProblem,
    cells: Sequence[Cell],
    entry: FloatArray,
    target: FloatArray,
    transition: Transition,
    k: int,
) -> Transition | None:
    """Return a transition along the widest path in a region; None where there is none."""
    try:
        route = find_route(problem, cells, entry, target, k)
    except (GeometryError, StallError):
        return None
    return replace(
        transition,
        target=target,
        inradius=route.inradius,
        governed=cells[0].tidied,
        **route.passage_fields,
    )
