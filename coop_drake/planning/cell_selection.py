"""The plan to execute: the path is covered with other boxes, so that the transport takes less time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from shapely import Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.document import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError, TooQuickError
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.jit import compiled
from coop_drake.laws import GainSet
from coop_drake.laws.gains import Schedule, schedule_of, scheduled_axis, scheduled_governor
from coop_drake.laws.governor import FIELD_SPEED, steady_clearance
from coop_drake.laws.ppc import CLOSING
from coop_drake.laws.readiness import interval_margin
from coop_drake.planning.boxes import BoxArrays, box_arrays, clearances_in_box, longest_box
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel, CoveredPath, Regions
from coop_drake.planning.duration import estimated, plan_time, timed
from coop_drake.planning.limits import NEED_FACTOR, limits_of
from coop_drake.planning.motion_limits import motion_limits, team_chains, times_at_limits
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
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import nearest_turn, usual_unit


def quickest_plan(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    room: FloatArray | None = None,
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
        room: Distance to the boundaries of cells that a motion keeps, of the position and of all axes, shape
            (2 + n,) [m, rad]; None for none.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: If the boxes that the search found are needed and their polygons cannot be made.
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
        TooQuickError: If a limit of acceleration would act; names the joint.
    """
    unit, room = usual_unit(problem.tree), np.zeros(len(problem.start) - 1) if room is None else room
    if unit == 1.0:
        return _quickest(problem, found, gain_set, gain_set_name, room, progress)
    scale = Rescaling(problem, unit)
    try:
        made = _quickest(
            scale.question(),
            scale.usual(found),
            scale.gains(gain_set),
            gain_set_name,
            scale.room(room),
            progress,
        )
    except TooQuickError:
        raise
    except (GeometryError, PlanError, StallError) as error:
        raise StallError(f"{error} (these lengths are to be multiplied by {unit:g})") from error
    # Gains have bounds in metres: a team of another size moves at another pace than in its usual unit.
    plan = with_gains(scale.plan(made), gain_set, gain_set_name)
    if not problem.passes:
        plan = keep_limits(problem, timed(plan), gain_set)
    return replace(plan, problem=problem_digest(problem))


def _quickest(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    gain_set_name: str,
    room: FloatArray,
    progress: Progress | None,
) -> Plan:
    if isinstance(found, Channel):
        found = turned_to_start(problem, found)
        check_ends(problem, found)
    path = found.path if found.path is not None else path_through(problem, found)
    if progress is not None:
        progress("choosing boxes", 0.0)

    def covered(limits: FloatArray | None = None) -> Plan | None:
        better = cover_path(problem, path, found.margin, gain_set, limits, room)
        if better is None:
            return None
        try:
            channel, targets = better
            return make_plan(
                problem, channel, gain_set, gain_set_name=gain_set_name, targets=targets, progress=progress
            )
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

PASSING_SHARE = 0.3
"""Share of these steps where the team passes from cell to cell: overlaps of boxes make it quicker [-]."""

HEARD_AFTER = 0.18
"""Time that a cell needs besides the stop itself, for reports and for the ramps of the brake, about [s]."""

LONG_WAY, LONG_WAY_STEP = 30.0, 0.6
"""On a path longer than this [m] waypoints may be this far apart [m]: most boxes are much longer there."""

HALVINGS = 6
"""Times that the path between two waypoints is halved until one box holds both."""

PADS = (0.005, 0.015, 0.03, 0.06)
"""Boxes are padded by one of these in every angle and joint [rad or m]."""

NARROW_PADS = (0.001, 0.003, 0.01, 0.03)
"""Paddings for narrow passages, where the smallest of the others is too wide [rad or m]."""

LEVELS = ((0.3, PADS), (0.1, NARROW_PADS), (0.0, NARROW_PADS))
"""Fractions of the margin that waypoints keep [-], and paddings; tried in this order until one works."""

LEAST_CLEARANCE = 2e-3
"""Waypoints keep at least this clearance [m]."""

BOX_COST = 9e-4
"""Every box costs this over its padding besides its time [rad s]: fewer boxes are better if the times are
equal, and narrow funnels leave little tolerance for what the closed form leaves out."""

DENSE_ENDS, SPARSE_STEP = 8, 3
"""Each of the first eight waypoints of a box is tried as its end; after them only every third one is."""

LARGEST_CLEARANCE = 1.0
"""Larger clearances count as this one [m]: the object has reached its highest speed."""


def cover_path(
    problem: PlanningProblem,
    path: FloatArray,
    margin: float,
    gain_set: GainSet,
    limits: FloatArray | None = None,
    room: FloatArray | None = None,
) -> tuple[Channel, tuple[FloatArray, ...]] | None:
    """Cover a path with boxes such that the transport is fast: few boxes, and narrow ones in narrow passages.

    The boxes are chosen by their times in closed form, see ``choose_boxes``. Every box is then proved
    free as in the search, by over-sweeps and Minkowski differences; a box that is not
    proved is not used.

    Args:
        problem: What was asked.
        path: Free configurations from start to goal, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        margin: The margin that the path keeps [m].
        gain_set: Gains, fixed or to be scheduled.
        limits: Largest speed of the object, then largest rates of all axes, shape (2 + n,) [m/s, rad/s or
            m/s]; None for none.
        room: As ``quickest_plan`` has it.

    Returns:
        The boxes, and for each a point in it and in the next one at which it is left, the last one the goal,
        shape (2,) [m]; None if no sequence of such boxes was found.
    """
    swept = SweptTree(problem.tree)
    boxes, grid = box_arrays(problem.tree), grid_inside(problem.workspace, problem.tree.reach)
    angle = float(path[-1, 2] + nearest_turn(float(problem.goal_pose[2] - path[-1, 2])))
    goals = np.array(final_intervals(problem, goal_values(problem, angle, path[-1, 2:])))
    limits = np.full(len(problem.start) - 1, np.inf) if limits is None else limits
    room = np.zeros(len(problem.start) - 1) if room is None else room
    # At a small margin some levels are equal; each is tried once.
    for least_clearance, pads in dict.fromkeys(
        (max(fraction * margin, LEAST_CLEARANCE), pads) for fraction, pads in LEVELS
    ):
        least, narrowest = least_clearance + float(room[0]), pads[0] + float(room[1:].max())
        points = _waypoints(boxes, grid, path, least, narrowest, PASSING_SHARE if problem.passes else 1.0)
        if points is None:
            continue
        if problem.passes:
            steps = times_at_limits(team_chains(problem), motion_limits(problem.limits), points)
        else:
            steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
        places = np.concatenate([[0.0], np.cumsum(steps)])
        waypoints = Waypoints(
            boxes, grid, points, places, np.array(pads), goals, schedule_of(gain_set), limits,
            least, problem.passes, room[1:],
        )  # fmt: skip
        rows, regions = choose_boxes(waypoints), Regions(problem, swept)
        tried = [regions.around(_box(waypoints, *row)) for row in rows.tolist()]
        free = tuple(box for box in tried if box is not None)  # Over-sweeps prove regions around their ends.
        if 0 < len(free) == len(rows):
            targets = (*(points[j, :2] for j in rows[:-1, 1]), problem.goal_pose[:2])
            return Channel(free, angle, margin=least_clearance), targets
    return None


def _waypoints(
    boxes: BoxArrays, grid: ObstacleGrid, path: FloatArray, least_clearance: float, pad: float, share: float
) -> FloatArray | None:
    """Waypoints along a path, so close that one box holds each of them with the next, shape (n, 3 + m).

    None if no box holds two waypoints after ``HALVINGS`` halvings.
    """
    moves = np.abs(np.diff(path, axis=0))
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    step = LONG_WAY_STEP if lengths.sum() > LONG_WAY else share * LENGTH_STEP
    paces = lengths / step, moves[:, 2:].max(axis=1) / (share * ANGLE_STEP)
    at = np.concatenate([[0.0], np.cumsum(np.maximum(*paces))])

    def configuration(s: float) -> FloatArray:
        return np.array([np.interp(s, at, column) for column in path.T])

    def between(first: float, last: float, halvings: int) -> list[FloatArray] | None:
        """Waypoints after the first place, the last one at the last place."""
        pair = np.stack([configuration(first), configuration(last)])
        furthest = longest_box(boxes, grid, pair, 0, 1, pad, least_clearance)[0]
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


def _box(waypoints: Waypoints, first: int, last: int, pad: int) -> FreeBox:
    """The box of some waypoints with one of the paddings, before its positions are known."""
    part, width = waypoints.path[first : last + 1], waypoints.pads[pad] + waypoints.room
    lower = np.maximum(waypoints.boxes.lower, part[:, 2:].min(axis=0) - width)
    upper = np.minimum(waypoints.boxes.upper, part[:, 2:].max(axis=0) + width)
    return FreeBox(Polygon(), lower, upper, part[:, :2].copy())


# The choice of boxes: a dynamic programme over waypoints, with the time of a box in closed form.


class Waypoints(NamedTuple):
    """Waypoints of a path, and the data with which boxes along them are tried.

    Attributes:
        boxes: The team.
        grid: The floor.
        path: Waypoints z, circular axes unwrapped, shape (n, 3 + joints) [m, rad].
        places: Where they lie along the path, shape (n,) [m; s where the team passes].
        pads: Paddings of a box to choose from, shape (p,) [rad or m].
        goals: Lower and upper ends of the last goal intervals, shape (2, m) [rad, m].
        schedule: The rules by which gains are chosen.
        limits: Largest speed of the object, then largest rates of all axes, shape (1 + m,) [m/s, rad/s].
        least_clearance: Clearance that every waypoint must keep [m].
        passing: Whether the team passes from cell to cell without a stop.
        room: By how much boxes are wider than their paddings at either end of every axis, which a motion does
            not use, shape (m,) [rad or m].
    """

    boxes: BoxArrays
    grid: ObstacleGrid
    path: FloatArray
    places: FloatArray
    pads: FloatArray
    goals: FloatArray
    schedule: Schedule
    limits: FloatArray
    least_clearance: float
    passing: bool
    room: FloatArray


@compiled
def choose_boxes(waypoints: Waypoints) -> IntArray:
    """Choose the boxes along waypoints that are crossed in the shortest time.

    Each box holds some consecutive waypoints, padded by one of a few widths. For every waypoint and every
    width of the next box, the quickest sequence of boxes that ends there is kept: its time is that of the
    sequence to where its last box begins, plus the time of that box: the longer one of those that the object
    needs at the governor's steady speed and the axes need to close their funnels. A box is swept only if it
    may be quicker than what is known, where the object is taken to need no less time than in the same box
    that ends before.

    Args:
        waypoints: The waypoints.

    Returns:
        For each box a row (first waypoint, last waypoint, index of the padding); none if there is no
        sequence.
    """
    n, count, m = len(waypoints.path), len(waypoints.pads), waypoints.path.shape[1] - 2
    time, before = np.full((n, count), np.inf), np.zeros((n, count, 2), np.int64)
    time[0] = 0.0
    least, most = waypoints.path[:, 2:].copy(), waypoints.path[:, 2:].copy()
    travel = np.zeros((n, count))  # The object's time in the longest box so far; infinite: not free.
    lower, upper, goals = np.empty(m), np.empty(m), np.empty((2, m))
    largest = waypoints.least_clearance if waypoints.passing else LARGEST_CLEARANCE
    for j in range(1, n):
        nexts = 1 if j + 1 == n else count
        for i in range(j):
            for a in range(m):
                least[i, a] = min(least[i, a], waypoints.path[j, 2 + a])
                most[i, a] = max(most[i, a], waypoints.path[j, 2 + a])
            if j - i > DENSE_ENDS and not waypoints.passing and (j - i) % SPARSE_STEP != 0 and j + 1 < n:
                continue
            for p in range(count):
                begun = time[i, p] + BOX_COST / waypoints.pads[p]
                if waypoints.passing and travel[i, p] < np.inf:
                    travel[i, p] = _passing_time(waypoints.places[j] - waypoints.places[i], waypoints.pads[p])
                if not begun + travel[i, p] < time[j, :nexts].max():
                    continue
                for a in range(m):
                    width = waypoints.pads[p] + waypoints.room[a]
                    lower[a] = max(waypoints.boxes.lower[a], least[i, a] - width)
                    upper[a] = min(waypoints.boxes.upper[a], most[i, a] + width)
                clearances = clearances_in_box(
                    waypoints.boxes, waypoints.grid, lower, upper, waypoints.path, i, j, largest
                )
                if len(clearances) == 0 or clearances.min() < waypoints.least_clearance:
                    travel[i, p] = np.inf
                    continue
                if not waypoints.passing:
                    travel[i, p] = _travel(waypoints, i, j, clearances)
                for q in range(nexts):
                    for a in range(m):
                        if j + 1 == n:
                            low, high = waypoints.goals[0, a], waypoints.goals[1, a]
                        else:
                            low = waypoints.path[j, 2 + a] - waypoints.pads[q]
                            high = waypoints.path[j, 2 + a] + waypoints.pads[q]
                        goals[0, a], goals[1, a] = max(lower[a], low), min(upper[a], high)
                    reached = begun + travel[i, p]
                    if not waypoints.passing:
                        reached = max(reached, begun + _closing(waypoints, i, lower, upper, goals))
                    if reached < time[j, q]:
                        time[j, q] = reached
                        before[j, q, 0], before[j, q, 1] = i, p
    rows = np.empty((n, 3), np.int64)
    j, q, first = n - 1, 0, n
    while j > 0 and time[n - 1, 0] < np.inf:
        first -= 1
        rows[first, 0], rows[first, 1], rows[first, 2] = before[j, q, 0], j, before[j, q, 1]
        j, q = before[j, q, 0], before[j, q, 1]
    return rows[first:]


@compiled(inlined=True)
def _passing_time(way: float, pad: float) -> float:
    """Time in which a team that passes from cell to cell crosses a box, from one waypoint to another [s].

    It moves at the pace v [-] from which it can stop within the box after it has received all reports of
    entry. With l the time of the way through the box at the limits of speed, and w the time for reports
    (``HEARD_AFTER``), v solves w v + v^2 / 2 = l.

    Args:
        way: Time between the waypoints at the limits of speed [s].
        pad: Padding of the box [rad or m]: seconds at 1 rad/s or 1 m/s.
    """
    pace = sqrt(HEARD_AFTER**2 + 2.0 * (way + 2.0 * pad)) - HEARD_AFTER
    return way / min(1.0, pace)


@compiled
def _travel(waypoints: Waypoints, i: int, j: int, clearances: FloatArray) -> float:
    """Time in which the object passes a box at the governor's steady speed, from waypoint i to j [s].

    Args:
        waypoints: The waypoints.
        i: The first waypoint.
        j: The last one.
        clearances: Clearance at the waypoints in the box, shape (j - i + 1,) [m].
    """
    stiffness, damping, gain = scheduled_governor(waypoints.schedule, clearances.min())
    per_speed = steady_clearance(1.0, stiffness, damping, gain)
    fastest, seconds = min(gain * FIELD_SPEED, waypoints.limits[0]), 0.0
    for k in range(j - i):
        clearance = 0.5 * (clearances[k] + clearances[k + 1])
        length = waypoints.places[i + k + 1] - waypoints.places[i + k]
        seconds += length / min(clearance / per_speed, fastest)
    return seconds


@compiled
def _closing(waypoints: Waypoints, i: int, lower: FloatArray, upper: FloatArray, goals: FloatArray) -> float:
    """Time in which the funnels of the axes close that are not in their goal intervals already [s].

    Args:
        waypoints: The waypoints.
        i: The waypoint at which the box is entered.
        lower: Lower ends of the slice, shape (m,) [rad or m].
        upper: Upper ends, shape (m,).
        goals: Lower and upper ends of the goal intervals, shape (2, m).
    """
    longest, narrowest = waypoints.schedule.hand_over_time, np.inf
    for a in range(1, len(lower)):
        narrowest = min(narrowest, goals[1, a] - goals[0, a])
    for a in range(len(lower)):
        resting = waypoints.path[i, 2 + a]
        if interval_margin(resting, goals[0, a], goals[1, a]) >= 0.0:
            continue
        rate = scheduled_axis(
            waypoints.schedule, a > 0, lower[a], upper[a], goals[0, a], goals[1, a], resting, narrowest,
            waypoints.limits[1 + a], np.inf,
        )[0]  # fmt: skip
        longest = max(longest, CLOSING / rate)
    return longest
