"""Compiled choice of boxes along waypoints, such that a transport through them is fast. It proves nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.gain_schedule import Schedule
from coop_drake.planning.boxes.box_kernels import BoxArrays, clearances_in_box
from coop_drake.planning.execution.transport_kernels import PERIOD
from coop_drake.planning.improvement.box_crossing import cross_box
from coop_drake.planning.improvement.object_motion import object_motion, smallest, soonest_exit
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.planning.travel_time import SETTLING_TIME
from coop_drake.tree.pose import FloatArray, IntArray

LONGEST = 20.0
"""A box that takes longer than this is not used [s]: two of them with a waypoint between are faster."""

BOX_COST = 9e-4
"""Every box costs this over its padding besides its simulated time [rad s]: fewer boxes are better if the
times are equal, and narrow funnels leave little tolerance for what the simulation leaves out."""

LARGEST_DELAY = SETTLING_TIME
"""Box sequences that reach a waypoint later than the fastest one by more than this are dropped [s]: the time
that angles need to settle is the most that a wider box can save."""

DENSE_ENDS, SPARSE_STEP = 8, 3
"""Each of the first eight waypoints of a box is tried as its end; after them only every third one is."""

LARGEST_CLEARANCE = 1.0
"""Larger clearances count as this one [m]: the object has reached its highest speed."""


class Waypoints(NamedTuple):
    """Waypoints of a path, and the data with which boxes along them are tried.

    Attributes:
        boxes: The team.
        grid: The floor.
        path: Waypoints z, theta unwrapped, shape (n, 3 + joints) [m, rad].
        places: Where they lie along the path, shape (n,) [m].
        pads: Paddings of a box to choose from, shape (p,) [rad or m].
        goals: Lower and upper ends of the last goal intervals, shape (2, m) [rad, m].
        schedule: The rules by which gains are chosen.
        limits: Largest speed of the object, then largest rates of all axes, shape (1 + m,) [m/s, rad/s].
        least_clearance: Clearance that every waypoint must keep [m].
        tolerance: Tolerance of the goal's position [m].
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
    tolerance: float


@compiled
def choose_boxes(waypoints: Waypoints) -> tuple[float, IntArray]:
    """Find the sequence of boxes along waypoints that is crossed in the shortest time.

    Each box holds some consecutive waypoints, padded by one of a few widths. By dynamic programming, for
    every waypoint and every width of the next box, the fastest sequence and its final state are stored.

    Args:
        waypoints: The waypoints.

    Returns:
        Estimated time [s], infinite if there is no sequence, and for each box a row (first waypoint, last
        waypoint, index of the padding).
    """
    n, count, m = len(waypoints.path), len(waypoints.pads), waypoints.path.shape[1] - 2
    best, states = np.empty((n, count)), np.zeros((n, count, 3 + 2 * m))
    before = np.empty((n, count, 2), np.int64)
    for p in range(count):
        for i in range(n):
            best[i, p] = np.inf if i > 0 else 0.0
            before[i, p, 0], before[i, p, 1] = -1, -1
        for a in range(m):
            states[0, p, 3 + a] = waypoints.path[0, 2 + a]
    low, high, lower, upper = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    checks = np.empty((int(LONGEST / PERIOD) + 2, 3))
    for i in range(n - 1):
        for p in range(count):
            if not best[i, p] < smallest(best[i]) + LARGEST_DELAY:
                continue
            for a in range(m):
                low[a], high[a] = waypoints.path[i, 2 + a], waypoints.path[i, 2 + a]
            for j in range(i + 1, n):
                for a in range(m):
                    low[a] = min(low[a], waypoints.path[j, 2 + a])
                    high[a] = max(high[a], waypoints.path[j, 2 + a])
                    lower[a] = max(waypoints.boxes.lower[a], low[a] - waypoints.pads[p])
                    upper[a] = min(waypoints.boxes.upper[a], high[a] + waypoints.pads[p])
                if j - i > DENSE_ENDS and (j - i) % SPARSE_STEP != 0 and j + 1 < n:
                    continue
                clearances = clearances_in_box(
                    waypoints.boxes, waypoints.grid, lower, upper, waypoints.path, i, j, LARGEST_CLEARANCE
                )
                if len(clearances) == 0 or smallest(clearances) < waypoints.least_clearance:
                    break
                _reach(waypoints, i, p, j, lower, upper, clearances, best, states, before, checks)
    return best[n - 1, 0], _box_rows(before)


@compiled
def _reach(
    waypoints: Waypoints,
    i: int,
    p: int,
    j: int,
    lower: FloatArray,
    upper: FloatArray,
    clearances: FloatArray,
    best: FloatArray,
    states: FloatArray,
    before: IntArray,
    checks: FloatArray,
) -> None:
    """Cross a box from waypoint i to j for every padding of the next box, and keep what is faster.

    Args:
        waypoints: The waypoints.
        i: Waypoint where the box begins.
        p: Its padding.
        j: Waypoint where it ends.
        lower: Its lower ends, shape (m,) [rad, m].
        upper: Its upper ends, shape (m,).
        clearances: Clearances at its waypoints, shape (j - i + 1,) [m].
        best: Earliest time at which each waypoint is reached, by the next box's padding, shape (n, p) [s].
        states: States in which that happens, shape (n, p, 3 + 2 m).
        before: First waypoint and padding of the box before, shape (n, p, 2).
        checks: Memory for the object's motion, as in ``object_motion``.
    """
    last = j + 1 == len(waypoints.path)
    m, nexts = len(lower), 1 if last else len(waypoints.pads)
    ends, state = np.empty((2, m)), np.empty(3 + 2 * m)
    begun = best[i, p] + BOX_COST / waypoints.pads[p]
    latest = 0.0
    for q in range(nexts):
        latest = max(latest, best[j, q])
    motion = object_motion(
        states[i, p], waypoints.places[i : j + 1], clearances, waypoints.schedule, waypoints.limits[0],
        waypoints.tolerance if last else 0.0, checks,
    )  # fmt: skip
    soonest = begun + soonest_exit(motion, min(LONGEST, latest - begun))
    for q in range(nexts):
        if soonest >= best[j, q]:
            continue
        for a in range(m):
            if last:
                low, high = waypoints.goals[0, a], waypoints.goals[1, a]
            else:
                low, high = (
                    waypoints.path[j, 2 + a] - waypoints.pads[q],
                    waypoints.path[j, 2 + a] + waypoints.pads[q],
                )
            ends[0, a], ends[1, a] = max(lower[a], low), min(upper[a], high)
        for k in range(len(state)):
            state[k] = states[i, p, k]
        time = begun + cross_box(
            state, motion, lower, upper, ends, waypoints.path[i, 2:], waypoints.schedule,
            waypoints.limits[1:], min(LONGEST, best[j, q] - begun),
        )  # fmt: skip
        if time < best[j, q]:
            best[j, q] = time
            for k in range(len(state)):
                states[j, q, k] = state[k]
            before[j, q, 0], before[j, q, 1] = i, p


@compiled
def _box_rows(before: IntArray) -> IntArray:
    """A row (first waypoint, last waypoint, padding) for each box; none if the goal was not reached."""
    rows = np.empty((len(before), 3), np.int64)
    j, q, first = len(before) - 1, 0, len(rows)
    while j > 0 and before[j, q, 0] >= 0:
        first -= 1
        rows[first, 0], rows[first, 1], rows[first, 2] = before[j, q, 0], j, before[j, q, 1]
        j, q = before[j, q, 0], before[j, q, 1]
    return rows[first:]
