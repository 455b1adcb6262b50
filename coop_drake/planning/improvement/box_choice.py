"""Compiled choice of boxes along a way: the chain that is crossed in the least time. It proves nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.gain_schedule import Schedule
from coop_drake.planning.boxes.box_kernels import BoxArrays, clearances_in_box
from coop_drake.planning.improvement.box_crossing import cross_box
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = ["Course", "choose_boxes", "fits"]

LONGEST = 20.0
"""A box that takes longer than this is not used [s]."""

BOX_COST = 9e-4
"""A box counts this over its padding more than is simulated [rad s]: few boxes are better where all else is
equal, and narrow funnels leave little room for what the simulation does not know."""

LATEST = 0.6
"""Ways to reach a waypoint that are later than the quickest one by more than this are not pursued [s]."""

EVERY, SOME = 8, 3
"""After so many waypoints only every third one is tried as the end of a box."""

FAR = 1.0
"""Clearances above this are not told apart [m]."""


class Course(NamedTuple):
    """A path and what boxes along it are tried with.

    Attributes:
        boxes: The team.
        grid: The floor.
        path: Waypoints z, theta unwrapped, shape (n, 3 + joints) [m, rad].
        places: Where they lie along the path, shape (n,) [m].
        pads: Paddings of a box to choose from, shape (p,) [rad or m].
        goals: Lower and upper ends of the last goal intervals, shape (2, m).
        schedule: Gains.
        least: Clearance that every waypoint must keep [m].
        tolerance: Of the goal's position [m].
    """

    boxes: BoxArrays
    grid: ObstacleGrid
    path: FloatArray
    places: FloatArray
    pads: FloatArray
    goals: FloatArray
    schedule: Schedule
    least: float
    tolerance: float


@compiled
def fits(
    boxes: BoxArrays, grid: ObstacleGrid, lower: FloatArray, upper: FloatArray, path: FloatArray, least: float
) -> bool:
    """Whether the swept team keeps a clearance of ``least`` [m] at every row of a path, and no bodies touch.

    Other arguments as in ``clearances_in_box``.
    """
    clearances = clearances_in_box(boxes, grid, lower, upper, path, 0, len(path) - 1, FAR)
    return len(clearances) > 0 and _least(clearances) >= least


@compiled
def _least(values: FloatArray) -> float:
    """The smallest of some values, shape (k,)."""
    least = np.inf
    for k in range(len(values)):
        least = min(least, values[k])
    return least


@compiled
def choose_boxes(course: Course, banned: FloatArray) -> tuple[float, IntArray]:
    """Find the chain of boxes along a way that is crossed in the least time.

    Each box is the hull of a stretch of the way, padded by one of a few widths. Every waypoint is reached by
    the quickest chain for each width that the next box may have; the state in which that happens is kept.

    Args:
        course: The way.
        banned: Positive where a box (first waypoint, last one, padding) must not be used, shape (n, n, p).

    Returns:
        Estimated time [s], infinite if there is no chain, and its rows (first waypoint, last one, padding).
    """
    n, count, m = len(course.path), len(course.pads), course.path.shape[1] - 2
    best = np.full((n, count), np.inf)
    states = np.zeros((n, count, 3 + 2 * m))
    before = np.full((n, count, 2), -1, np.int64)
    for p in range(count):
        best[0, p] = 0.0
        for a in range(m):
            states[0, p, 3 + a] = course.path[0, 2 + a]
    low, high, lower, upper = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    for i in range(n - 1):
        for p in range(count):
            if not best[i, p] < _least(best[i]) + LATEST:
                continue
            for a in range(m):
                low[a], high[a] = course.path[i, 2 + a], course.path[i, 2 + a]
            for j in range(i + 1, n):
                for a in range(m):
                    low[a] = min(low[a], course.path[j, 2 + a])
                    high[a] = max(high[a], course.path[j, 2 + a])
                    lower[a] = max(course.boxes.lower[a], low[a] - course.pads[p])
                    upper[a] = min(course.boxes.upper[a], high[a] + course.pads[p])
                if j - i > EVERY and (j - i) % SOME != 0 and j + 1 < n:
                    continue
                clearances = clearances_in_box(
                    course.boxes, course.grid, lower, upper, course.path, i, j, FAR
                )
                if len(clearances) == 0 or _least(clearances) < course.least:
                    break
                if banned[i, j, p] <= 0.0:
                    _reach(course, i, p, j, lower, upper, clearances, best, states, before)
    return best[n - 1, 0], _chain(before)


@compiled
def _reach(
    course: Course,
    i: int,
    p: int,
    j: int,
    lower: FloatArray,
    upper: FloatArray,
    clearances: FloatArray,
    best: FloatArray,
    states: FloatArray,
    before: IntArray,
) -> None:
    """Cross a box from waypoint i to j for every padding of the next one; keep what is quicker.

    Args:
        course: The path.
        i: Waypoint where the box begins.
        p: Its padding.
        j: Waypoint where it ends.
        lower: Its lower ends, shape (m,) [rad, m].
        upper: Its upper ends, shape (m,).
        clearances: Clearances at its waypoints, shape (j - i + 1,) [m].
        best: Earliest time at which each waypoint is reached, by the next box's padding, shape (n, p) [s].
        states: States in which that happens, shape (n, p, 3 + 2 m).
        before: First waypoint and padding of the box before, shape (n, p, 2).
    """
    last = j + 1 == len(course.path)
    m = len(lower)
    ends, state = np.empty((2, m)), np.empty(3 + 2 * m)
    for q in range(1 if last else len(course.pads)):
        for a in range(m):
            if last:
                low, high = course.goals[0, a], course.goals[1, a]
            else:
                low, high = course.path[j, 2 + a] - course.pads[q], course.path[j, 2 + a] + course.pads[q]
            ends[0, a], ends[1, a] = max(lower[a], low), min(upper[a], high)
        for k in range(len(state)):
            state[k] = states[i, p, k]
        limit = min(LONGEST, best[j, q] - best[i, p])
        time = best[i, p] + BOX_COST / course.pads[p]
        time += cross_box(
            state, course.places[i : j + 1], clearances, lower, upper, ends, course.path[i, 2:],
            course.schedule, course.tolerance if last else 0.0, limit,
        )  # fmt: skip
        if time < best[j, q]:
            best[j, q] = time
            for k in range(len(state)):
                states[j, q, k] = state[k]
            before[j, q, 0], before[j, q, 1] = i, p


@compiled
def _chain(before: IntArray) -> IntArray:
    """Boxes up to the last waypoint, rows (first waypoint, last one, padding); none if it was not reached."""
    rows = np.empty((len(before), 3), np.int64)
    j, q, first = len(before) - 1, 0, len(rows)
    while j > 0 and before[j, q, 0] >= 0:
        first -= 1
        rows[first, 0], rows[first, 1], rows[first, 2] = before[j, q, 0], j, before[j, q, 1]
        j, q = before[j, q, 0], before[j, q, 1]
    return rows[first:]
