"""Compiled choice of boxes along a way: the chain that is crossed in the least time. It proves nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.sweep_kernels import IntArray, over_piece
from coop_drake.laws.gain_schedule import Schedule
from coop_drake.planning.boxes.box_kernels import BoxArrays, bodies_apart, enclosing_disc, ring_clearance
from coop_drake.planning.improvement.box_crossing import cross_box
from coop_drake.planning.sampling.obstacle_grid import Walls
from coop_drake.tree.pose import FloatArray

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
    """A way and what boxes along it are tried with.

    Attributes:
        boxes: The team.
        walls: The floor.
        way: Waypoints z, theta unwrapped, shape (n, 3 + joints) [m, rad].
        places: Where they lie along the way, shape (n,) [m].
        pads: Paddings of a box to choose from, shape (p,) [rad or m].
        goals: Lower and upper ends of the last goal intervals, shape (2, m).
        schedule: Gains.
        least: Clearance that every waypoint must keep [m].
        tolerance: Of the goal's position [m].
    """

    boxes: BoxArrays
    walls: Walls
    way: FloatArray
    places: FloatArray
    pads: FloatArray
    goals: FloatArray
    schedule: Schedule
    least: float
    tolerance: float


@compiled
def _clearances(
    boxes: BoxArrays, walls: Walls, lower: FloatArray, upper: FloatArray, way: FloatArray, most: float
) -> FloatArray:
    """Distance of the swept team from the walls at every position; empty if one is in the way."""
    nothing = np.empty(0)
    result = np.full(len(way), most)
    for piece in range(len(boxes.sweeps.radius) - 1, -1, -1):
        stages = boxes.sweeps.first_stage[piece + 1] - boxes.sweeps.first_stage[piece]
        ring = over_piece(boxes.sweeps, piece, lower, upper, stages, True)
        disc = enclosing_disc(ring)
        for k in range(len(way)):
            result[k] = ring_clearance(ring, disc, walls, way[k, 0], way[k, 1], result[k])
            if result[k] < 0.0:
                return nothing
    return result if bodies_apart(boxes, lower, upper) else nothing


@compiled
def fits(
    boxes: BoxArrays, walls: Walls, lower: FloatArray, upper: FloatArray, way: FloatArray, least: float
) -> bool:
    """Whether the swept team keeps a clearance at every position of a way, and no bodies touch."""
    room = _clearances(boxes, walls, lower, upper, way, FAR)
    return len(room) > 0 and room.min() >= least


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
    n, count, m = len(course.way), len(course.pads), course.way.shape[1] - 2
    best = np.full((n, count), np.inf)
    states = np.zeros((n, count, 3 + 2 * m))
    before = np.full((n, count, 2), -1, np.int64)
    best[0] = 0.0
    states[0, :, 3 : 3 + m] = course.way[0, 2:]
    for i in range(n - 1):
        for p in range(count):
            if not best[i, p] < best[i].min() + LATEST:
                continue
            lowest, highest = course.way[i, 2:].copy(), course.way[i, 2:].copy()
            for j in range(i + 1, n):
                lowest, highest = (
                    np.minimum(lowest, course.way[j, 2:]),
                    np.maximum(highest, course.way[j, 2:]),
                )
                if j - i > EVERY and (j - i) % SOME != 0 and j + 1 < n:
                    continue
                lower = np.maximum(course.boxes.lower, lowest - course.pads[p])
                upper = np.minimum(course.boxes.upper, highest + course.pads[p])
                way = course.way[i : j + 1, :2]
                room = _clearances(course.boxes, course.walls, lower, upper, way, FAR)
                if len(room) == 0 or room.min() < course.least:
                    break
                if banned[i, j, p] <= 0.0:
                    _reach(course, i, p, j, lower, upper, room, best, states, before)
    return best[n - 1, 0], _chain(before)


@compiled
def _reach(
    course: Course,
    i: int,
    p: int,
    j: int,
    lower: FloatArray,
    upper: FloatArray,
    room: FloatArray,
    best: FloatArray,
    states: FloatArray,
    before: IntArray,
) -> None:
    """Cross a box from waypoint i to j for every padding of the next one; keep what is quicker."""
    last = j + 1 == len(course.way)
    for q in range(1 if last else len(course.pads)):
        ends = np.empty((2, len(lower)))
        if last:
            ends[0], ends[1] = np.maximum(lower, course.goals[0]), np.minimum(upper, course.goals[1])
        else:
            ends[0] = np.maximum(lower, course.way[j, 2:] - course.pads[q])
            ends[1] = np.minimum(upper, course.way[j, 2:] + course.pads[q])
        state = states[i, p].copy()
        limit = min(LONGEST, best[j, q] - best[i, p])
        time = best[i, p] + BOX_COST / course.pads[p]
        time += cross_box(
            state, course.places[i : j + 1], room, lower, upper, ends, course.way[i, 2:], course.schedule,
            course.tolerance if last else 0.0, limit,
        )  # fmt: skip
        if time < best[j, q]:
            best[j, q], states[j, q] = time, state
            before[j, q, 0], before[j, q, 1] = i, p


@compiled
def _chain(before: IntArray) -> IntArray:
    """Boxes from the first to the last waypoint, none if it was not reached."""
    rows = np.empty((len(before), 3), np.int64)
    j, q, k = len(before) - 1, 0, 0
    while j > 0 and before[j, q, 0] >= 0:
        rows[k, 0], rows[k, 1], rows[k, 2] = before[j, q, 0], j, before[j, q, 1]
        j, q, k = before[j, q, 0], before[j, q, 1], k + 1
    return rows[:k][::-1].copy()
