"""Waypoints along a path, and the sequences of boxes along them that have been found."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.gain_schedule import Schedule
from coop_drake.planning.boxes.box_sweeps import BoxArrays
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.tree.pose import FloatArray, IntArray


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
