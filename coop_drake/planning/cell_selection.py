"""The plan to execute: the path is covered with other boxes, so that the transport takes less time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil

import numpy as np
from shapely import Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError, TooQuickError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.laws import GainSet
from coop_drake.laws.gain_schedule import schedule_of
from coop_drake.planning.box_choice import Waypoints, choose_boxes
from coop_drake.planning.boxes import BoxArrays, box_arrays, longest_box
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel, CoveredPath, Regions
from coop_drake.planning.duration import estimated, plan_time, timed
from coop_drake.planning.limits import NEED_FACTOR, limits_of
from coop_drake.planning.questions import shrunk
from coop_drake.planning.rescaling import Rescaling
from coop_drake.planning.sampling.collision import ObstacleGrid, grid_inside
from coop_drake.planning.transitions import (
    check_ends,
    final_intervals,
    goal_values,
    keep_limits,
    make_plan,
    path_through,
    turned_to_start,
    with_gains,
)
from coop_drake.progress import Progress
from coop_drake.tree.component_tree import nearest_turn, usual_unit
from coop_drake.tree.pose import FloatArray


def quickest_plan(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    least_overlap: float = 0.0,
    progress: Progress | None = None,
) -> Plan:
    """Make a plan along the path of a search's result, with other boxes if these can be found.

    Teams of an unusual size are planned in a unit of length in which their size is usual.

    With the paper's fixed gains narrow scenarios often have no faster boxes; the plan then uses the boxes
    that the search found.

    Args:
        problem: What was asked.
        found: The channel that a search found, or a path that boxes cover.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        least_overlap: Least overlap of consecutive boxes in every angle and joint [rad or m].
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: If the boxes that the search found are needed and their polygons cannot be made.
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
        TooQuickError: If a limit of acceleration would act; names the joint.
    """
    unit = usual_unit(problem.tree)
    if unit == 1.0:
        return _quickest(problem, found, gain_set, gain_set_name, least_overlap, progress)
    scale = Rescaling(problem, unit)
    try:
        made = _quickest(
            scale.question(),
            scale.usual(found),
            scale.gains(gain_set),
            gain_set_name,
            least_overlap,
            progress,
        )
    except TooQuickError:
        raise
    except (GeometryError, PlanError, StallError) as error:
        raise StallError(f"{error} (these lengths are to be multiplied by {unit:g})") from error
    # Gains have bounds in metres: a team of another size moves at another pace than in its usual unit.
    plan = timed(with_gains(scale.plan(made), gain_set, gain_set_name))
    return replace(keep_limits(problem, plan, gain_set), problem=problem_digest(problem))


def _quickest(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    gain_set_name: str,
    least_overlap: float,
    progress: Progress | None,
) -> Plan:
    if isinstance(found, Channel):
        found = turned_to_start(problem, found)
        check_ends(problem, found)
    path = found.path if found.path is not None else path_through(problem, found)
    if progress is not None:
        progress("choosing boxes", 0.0)

    def covered(limits: FloatArray | None = None) -> Plan | None:
        better = cover_path(problem, path, found.margin, gain_set, least_overlap, limits)
        if better is None:
            return None
        try:
            return make_plan(
                problem, better.channel, gain_set, gain_set_name=gain_set_name, targets=better.targets,
                progress=progress,
            )  # fmt: skip
        except TooQuickError:  # other boxes would not be slower
            raise
        except (GeometryError, PlanError, StallError, ShapelyError):
            # The boxes that the search found are proved free too, and their passages may be wider.
            return None

    plan = covered()
    if plan is not None:
        slower = covered(limits_of(plan)) if _is_slowed(plan) else None
        return plan if slower is None or plan_time(plan) <= plan_time(slower) else slower
    channel = found if isinstance(found, Channel) else found.channel()
    return make_plan(problem, channel, gain_set, gain_set_name=gain_set_name, progress=progress)


def _is_slowed(plan: Plan) -> bool:
    """Whether limits of speed slow a plan down, so that other boxes may be quicker."""
    limits = limits_of(plan)
    return limits is not None and bool((NEED_FACTOR * estimated(plan)[1] > limits).any())


# Covering a path again: other boxes along it, with which the transport takes less time.

LENGTH_STEP, ANGLE_STEP = 0.3, 0.15
"""Waypoints are no farther apart than this in position [m] and in every angle or joint [rad or m]: twice as
many would make the choice of boxes four times as slow."""

LONG_WAY, LONG_WAY_STEP = 30.0, 0.6
"""On a path longer than this [m] waypoints may be this far apart [m]: most boxes are much longer there."""

HALVINGS = 6
"""Times that the path between two waypoints is halved until one box holds both."""

PADS = (0.005, 0.015, 0.03, 0.06)
"""Boxes are padded by one of these in every angle and joint [rad or m]."""

NARROW_PADS = (0.001, 0.003, 0.01, 0.03)
"""Paddings for narrow passages, where the smallest of the others is too wide [rad or m]."""

LEVELS = ((0.3, PADS), (0.1, NARROW_PADS))
"""Fractions of the margin that waypoints keep [-], and paddings; tried in this order until one works."""

LEAST_CLEARANCE = 2e-3
"""Waypoints keep at least this clearance [m]."""

CORE_FRACTION = 0.9
"""Fraction of the waypoints' clearance that cores keep, so that waypoints lie inside them [-]."""


@dataclass(frozen=True)
class PathCovering:
    """Boxes along a path, and the points at which each of them is left.

    Attributes:
        channel: The boxes.
        targets: A point for every box, in it and in the next one, the last one the goal, each (2,) [m].
    """

    channel: Channel
    targets: tuple[FloatArray, ...]


def cover_path(
    problem: PlanningProblem,
    path: FloatArray,
    margin: float,
    gain_set: GainSet,
    least_overlap: float = 0.0,
    limits: FloatArray | None = None,
) -> PathCovering | None:
    """Cover a path with boxes such that the transport is fast: few boxes, and narrow ones in narrow passages.

    The boxes are chosen by a compiled simulation of the closed loop. Every box is then proved free as in the
    search, by over-sweeps and Minkowski differences at margin zero; a box that is not proved is not used.

    Args:
        problem: What was asked.
        path: Free configurations from start to goal, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        margin: The margin that the path keeps [m].
        gain_set: Gains, fixed or to be scheduled.
        least_overlap: Least overlap of consecutive boxes in every angle and joint [rad or m].
        limits: Largest speed of the object, then largest rates of all axes, shape (2 + n,) [m/s, rad/s or
            m/s]; None for none.

    Returns:
        The boxes, or None if no sequence of such boxes was found.
    """
    swept = SweptTree(problem.tree)
    pairs = BodyPairs(swept)
    floor = shrunk(problem.workspace, 0.0)
    boxes, grid = box_arrays(swept, pairs), grid_inside(floor, problem.tree.reach)
    angle = float(path[-1, 2] + nearest_turn(float(problem.goal_pose[2] - path[-1, 2])))
    goals = np.array(final_intervals(problem, goal_values(problem, angle, path[-1, 2:])))
    limits = np.full(len(problem.start) - 1, np.inf) if limits is None else limits
    # At a small margin some levels are equal; each is tried once.
    for least_clearance, pads in dict.fromkeys(
        (max(fraction * margin, LEAST_CLEARANCE), _wide(pads, 0.5 * least_overlap))
        for fraction, pads in LEVELS
    ):
        points = _waypoints(boxes, grid, path, least_clearance, pads[0])
        if points is None:
            continue
        places = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
        waypoints = Waypoints(
            boxes, grid, points, places, np.array(pads), goals, schedule_of(gain_set), limits,
            least_clearance, problem.position_tolerance,
        )  # fmt: skip
        found = _fastest_boxes(waypoints, Regions(problem, swept, pairs, CORE_FRACTION * least_clearance))
        if found is not None:
            free, ends = found
            targets = (*(points[j, :2] for j in ends[:-1]), problem.goal_pose[:2])
            return PathCovering(Channel(tuple(free), CORE_FRACTION * least_clearance, angle), targets)
    return None


def _wide(pads: tuple[float, ...], least: float) -> tuple[float, ...]:
    """Return the paddings that are wide enough, in place of narrower ones once and twice the least."""
    return tuple(sorted({pad for pad in (*pads, least, 2.0 * least) if pad >= max(least, pads[0])}))


def _waypoints(
    boxes: BoxArrays, grid: ObstacleGrid, path: FloatArray, least_clearance: float, pad: float
) -> FloatArray | None:
    """Waypoints along a path, so close that one box holds each of them with the next, shape (n, 3 + m).

    None if no box holds two waypoints after ``HALVINGS`` halvings.
    """
    moves = np.abs(np.diff(path, axis=0))
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    step = LONG_WAY_STEP if lengths.sum() > LONG_WAY else LENGTH_STEP
    paces = lengths / step, moves[:, 2:].max(axis=1) / ANGLE_STEP
    at = np.concatenate([[0.0], np.cumsum(np.maximum(*paces))])

    def configuration(s: float) -> FloatArray:
        return np.array([np.interp(s, at, column) for column in path.T])

    def between(first: float, last: float, halvings: int) -> list[FloatArray] | None:
        """Waypoints after the first place, the last one at the last place."""
        pair = np.stack([configuration(first), configuration(last)])
        furthest = longest_box(boxes, grid, pair, 0, 1, pad, least_clearance, 0.0)[1]
        if furthest == 1:
            return [pair[1]]
        if halvings == 0:
            return None
        middle = 0.5 * (first + last)
        one = between(first, middle, halvings - 1)
        other = None if one is None else between(middle, last, halvings - 1)
        return None if one is None or other is None else one + other

    stops = np.linspace(0.0, at[-1], max(1, ceil(at[-1])) + 1)
    points = [path[0]]
    for first, last in pairwise(stops.tolist()):
        held = between(first, last, HALVINGS)
        if held is None:
            return None
        points += held
    return np.array(points)


def _fastest_boxes(waypoints: Waypoints, regions: Regions) -> tuple[list[FreeBox], list[int]] | None:
    """The fastest boxes, and the waypoint at which each of them ends; None if one is not proved free."""
    _, rows = choose_boxes(waypoints)
    boxes = [_proved(waypoints, regions, first, last, pad) for first, last, pad in rows]
    proved = [box for box in boxes if box is not None]
    return (proved, rows[:, 1].tolist()) if 0 < len(proved) == len(rows) else None


def _proved(waypoints: Waypoints, regions: Regions, first: int, last: int, pad: int) -> FreeBox | None:
    """The box of some waypoints, if over-sweeps prove a region free that holds the first and the last one."""
    part, width = waypoints.path[first : last + 1], waypoints.pads[pad]
    lower = np.maximum(waypoints.boxes.lower, part[:, 2:].min(axis=0) - width)
    upper = np.minimum(waypoints.boxes.upper, part[:, 2:].max(axis=0) + width)
    return regions.around(FreeBox(Polygon(), Polygon(), lower, upper, part[:, :2].copy()))
