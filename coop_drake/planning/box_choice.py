"""Compiled choice of boxes along waypoints, such that a transport through them is fast. It proves nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.gain_schedule import Schedule
from coop_drake.laws.governor import (
    FIELD_SPEED,
)
from coop_drake.planning.box_crossing import ObjectMotion, cross_box, object_motion, smallest, soonest_exit
from coop_drake.planning.boxes import BoxArrays, clearances_in_box
from coop_drake.planning.duration import PERIOD, SETTLING_TIME
from coop_drake.planning.sampling.collision import ObstacleGrid
from coop_drake.tree.pose import FloatArray, IntArray

# Waypoints along a path, and the sequences of boxes along them that have been found.


class Waypoints(NamedTuple):
    """Waypoints of a path, and the data with which boxes along them are tried.

    Attributes:
        boxes: The team.
        grid: The floor.
        path: Waypoints z, circular axes unwrapped, shape (n, 3 + joints) [m, rad].
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


class Sequences(NamedTuple):
    """The fastest box sequence to every waypoint, for every padding of the box that follows.

    Attributes:
        time: When each waypoint is reached, by the next box's padding, shape (n, p) [s].
        states: States in which that happens, shape (n, p, 3 + 2 m).
        before: First waypoint and padding of the box before, -1 for none, shape (n, p, 2).
    """

    time: FloatArray
    states: FloatArray
    before: IntArray


class BegunBoxes(NamedTuple):
    """The boxes that begin at each waypoint, as far as they have been followed.

    Attributes:
        lower: Least values of (theta, q...) from each waypoint on, shape (n, m) [rad, m].
        upper: Greatest values, shape (n, m).
        held: 1 where the box with each padding may hold further waypoints, shape (n, p).
        delay: When the box may be left at the soonest, less the time in which the path up to its end is
            passed at the largest speed, shape (n, p) [s]; it is taken never to fall from an end to a further
            one.
    """

    lower: FloatArray
    upper: FloatArray
    held: IntArray
    delay: FloatArray


@compiled
def box_rows(before: IntArray) -> IntArray:
    """A row (first waypoint, last waypoint, padding) for each box; none if the goal was not reached."""
    rows = np.empty((len(before), 3), np.int64)
    j, q, first = len(before) - 1, 0, len(rows)
    while j > 0 and before[j, q, 0] >= 0:
        first -= 1
        rows[first, 0], rows[first, 1], rows[first, 2] = before[j, q, 0], j, before[j, q, 1]
        j, q = before[j, q, 0], before[j, q, 1]
    return rows[first:]


LONGEST = 20.0
"""A box that takes longer than this is not used [s]: two of them with a waypoint between are faster."""

BOX_COST = 9e-4
"""Every box costs this over its padding besides its simulated time [rad s]: fewer boxes are better if the
times are equal, and narrow funnels leave little tolerance for what the simulation leaves out."""

LARGEST_DELAY = SETTLING_TIME
"""Box sequences that reach a waypoint later than the fastest one by more than this are dropped [s]: the time
that angles need to settle is the most that a wider box can save."""

LARGEST_SPEED = 2.0 * FIELD_SPEED
"""The object is taken to move at most this fast between two ends that are tried for a box [m/s]: twice the
largest field (13). It is no bound: a box in which the object is quicker may be looked at again too late."""

DENSE_ENDS, SPARSE_STEP = 8, 3
"""Each of the first eight waypoints of a box is tried as its end; after them only every third one is."""

LARGEST_CLEARANCE = 1.0
"""Larger clearances count as this one [m]: the object has reached its highest speed."""

ROUNDING = 1e-9
"""Differences of times may be wrong by this [s]: of equally quick boxes the one that begins first is used."""


@compiled
def choose_boxes(waypoints: Waypoints) -> tuple[float, IntArray]:
    """Find the sequence of boxes along waypoints that is crossed in the shortest time.

    Each box holds some consecutive waypoints, padded by one of a few widths. By dynamic programming, for
    every waypoint and every width of the next box, the fastest sequence and its final state are stored.
    Of the boxes that end at a waypoint the motion of the object comes first: it bounds the time from below.
    The axes are simulated only in boxes whose bound is less than the fastest time known. A box that was too
    slow at an earlier waypoint is looked at again where it may have caught up.

    Args:
        waypoints: The waypoints.

    Returns:
        Estimated time [s], infinite if there is no sequence, and for each box a row (first waypoint, last
        waypoint, index of the padding).
    """
    n, count, m = len(waypoints.path), len(waypoints.pads), waypoints.path.shape[1] - 2
    found = Sequences(
        np.full((n, count), np.inf), np.zeros((n, count, 3 + 2 * m)), np.full((n, count, 2), -1)
    )
    boxes = BegunBoxes(
        waypoints.path[:, 2:].copy(), waypoints.path[:, 2:].copy(), np.ones((n, count), np.int64),
        np.zeros((n, count)),
    )  # fmt: skip
    for p in range(count):
        found.time[0, p] = 0.0
        for a in range(m):
            found.states[0, p, 3 + a] = waypoints.path[0, 2 + a]
    checks = np.empty((int(LONGEST / PERIOD) + 2, 3))
    first = 0
    for j in range(1, n):
        for p in range(count):
            if not found.time[j - 1, p] < smallest(found.time[j - 1]) + LARGEST_DELAY:
                boxes.held[j - 1, p] = 0
            boxes.delay[j - 1, p] = _begun(waypoints, found, j - 1, p) - _least_time(waypoints, j - 1)
        while first < j and boxes.held[first].sum() == 0:
            first += 1
        _end_boxes(waypoints, first, j, boxes, found, checks)
    return found.time[n - 1, 0], box_rows(found.before)


@compiled
def _end_boxes(
    waypoints: Waypoints, first: int, j: int, boxes: BegunBoxes, found: Sequences, checks: FloatArray
) -> None:
    """Find the fastest sequences that reach waypoint j, by boxes that begin at waypoint ``first`` or later.

    Args:
        waypoints: The waypoints.
        first: No box that begins before holds waypoint j.
        j: Where boxes end.
        boxes: All boxes; those that do not hold waypoint j are not followed any further.
        found: The fastest sequences to the waypoints before; those to j are written.
        checks: Memory for the object's motion, as in ``object_motion``.
    """
    m = boxes.lower.shape[1]
    lower, upper = np.empty(m), np.empty(m)
    unknown = np.empty(0)
    begins, soonest, clearances_of = [(0, 0)][:0], [0.0][:0], [unknown][:0]
    for i in range(first, j):
        for a in range(m):
            boxes.lower[i, a] = min(boxes.lower[i, a], waypoints.path[j, 2 + a])
            boxes.upper[i, a] = max(boxes.upper[i, a], waypoints.path[j, 2 + a])
        if j - i > DENSE_ENDS and (j - i) % SPARSE_STEP != 0 and j + 1 < len(waypoints.path):
            continue
        for p in range(boxes.held.shape[1]):
            if boxes.held[i, p] == 1:
                begins.append((i, p))
                soonest.append(boxes.delay[i, p] + _least_time(waypoints, j))
                clearances_of.append(unknown)
    for _ in range(2 * len(begins)):
        k = 0
        for other in range(1, len(begins)):
            if soonest[other] < soonest[k]:
                k = other
        i, p = begins[k]
        if not _is_useful(soonest[k], j, found):
            break
        _widened(waypoints, boxes, i, p, lower, upper)
        if len(clearances_of[k]) == 0:
            clearances_of[k] = clearances_in_box(
                waypoints.boxes, waypoints.grid, lower, upper, waypoints.path, i, j, LARGEST_CLEARANCE
            )
            soonest[k] = _soonest_end(waypoints, boxes, found, i, p, j, clearances_of[k], checks)
        else:
            motion = _motion(waypoints, found, i, p, j, clearances_of[k], checks)
            _reach(waypoints, i, p, j, lower, upper, motion, soonest[k], found)
            soonest[k] = np.inf
    latest = smallest(found.time[j]) + LARGEST_DELAY - _least_time(waypoints, j)
    for i, p in begins:
        if boxes.delay[i, p] > latest:
            boxes.held[i, p] = 0


@compiled
def _soonest_end(
    waypoints: Waypoints,
    boxes: BegunBoxes,
    found: Sequences,
    i: int,
    p: int,
    j: int,
    clearances: FloatArray,
    checks: FloatArray,
) -> float:
    """When the box with padding p from waypoint i may be left at j, whatever the axes do [s].

    Infinity where it may not. A box that holds no further waypoints is not followed any more.
    """
    boxes.held[i, p] = len(clearances) > 0 and smallest(clearances) >= waypoints.least_clearance
    if boxes.held[i, p] == 0:
        return np.inf
    crossed = soonest_exit(_motion(waypoints, found, i, p, j, clearances, checks), LONGEST)
    if crossed == np.inf:
        if j - i > DENSE_ENDS:  # Only near ends can have less clearance than further ones.
            boxes.held[i, p] = 0
        return np.inf
    soonest: float = _begun(waypoints, found, i, p) + crossed
    boxes.delay[i, p] = soonest - _least_time(waypoints, j)
    return soonest


@compiled(borrows=True)
def _begun(waypoints: Waypoints, found: Sequences, i: int, p: int) -> float:
    """When the box with padding p from waypoint i is entered, with what a box costs besides its time [s]."""
    begun: float = found.time[i, p] + BOX_COST / waypoints.pads[p]
    return begun


@compiled(borrows=True)
def _least_time(waypoints: Waypoints, j: int) -> float:
    """Time in which the path up to waypoint j is passed at ``LARGEST_SPEED`` [s]."""
    least: float = waypoints.places[j] / LARGEST_SPEED
    return least


@compiled(borrows=True)
def _is_useful(soonest: float, j: int, found: Sequences) -> bool:
    """Whether a sequence that reaches waypoint j at a time would be the fastest for some next padding."""
    nexts = 1 if j + 1 == len(found.time) else found.time.shape[1]
    useful = False
    for q in range(nexts):
        useful = useful or soonest <= found.time[j, q]
    return useful


@compiled(borrows=True)
def _widened(
    waypoints: Waypoints, boxes: BegunBoxes, i: int, p: int, lower: FloatArray, upper: FloatArray
) -> None:
    """Write the ends of the box that begins at waypoint i, with padding p, shape (m,) each [rad, m]."""
    for a in range(len(lower)):
        lower[a] = max(waypoints.boxes.lower[a], boxes.lower[i, a] - waypoints.pads[p])
        upper[a] = min(waypoints.boxes.upper[a], boxes.upper[i, a] + waypoints.pads[p])


@compiled
def _motion(
    waypoints: Waypoints,
    found: Sequences,
    i: int,
    p: int,
    j: int,
    clearances: FloatArray,
    checks: FloatArray,
) -> ObjectMotion:
    """Begin the object's motion through the box with padding p from waypoint i to j."""
    return object_motion(
        found.states[i, p], waypoints.places[i : j + 1], clearances, waypoints.schedule, waypoints.limits[0],
        waypoints.tolerance if j + 1 == len(waypoints.path) else 0.0, checks,
    )  # fmt: skip


@compiled
def _reach(
    waypoints: Waypoints,
    i: int,
    p: int,
    j: int,
    lower: FloatArray,
    upper: FloatArray,
    motion: ObjectMotion,
    soonest: float,
    found: Sequences,
) -> None:
    """Cross a box from waypoint i to j for every padding of the next box, and keep what is faster.

    Args:
        waypoints: The waypoints.
        i: Waypoint where the box begins.
        p: Its padding.
        j: Waypoint where it ends.
        lower: Its lower ends, shape (m,) [rad, m].
        upper: Its upper ends, shape (m,).
        motion: The motion of the object through it.
        soonest: When the object may leave it [s].
        found: The fastest sequences.
    """
    last = j + 1 == len(waypoints.path)
    m, nexts = len(lower), 1 if last else len(waypoints.pads)
    ends, state = np.empty((2, m)), np.empty(3 + 2 * m)
    begun = _begun(waypoints, found, i, p)
    for q in range(nexts):
        if soonest > found.time[j, q]:
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
            state[k] = found.states[i, p, k]
        time = begun + cross_box(
            state, motion, lower, upper, ends, waypoints.path[i, 2:], waypoints.schedule,
            waypoints.limits[1:], min(LONGEST, found.time[j, q] - begun + ROUNDING),
        )  # fmt: skip
        begins_before = i < found.before[j, q, 0] or (
            i == found.before[j, q, 0] and p < found.before[j, q, 1]
        )
        if time < found.time[j, q] or (time == found.time[j, q] and begins_before):
            found.time[j, q] = time
            for k in range(len(state)):
                found.states[j, q, k] = state[k]
            found.before[j, q, 0], found.before[j, q, 1] = i, p
