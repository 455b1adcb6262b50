"""When a robot reports that it is ready to leave a cell, or that the goal is reached (after (10)-(12)).

Every margin is a number without unit, positive where the condition holds and at most 1. The margin of several
conditions is the smallest. A robot judges by the object's state, its own p_G and its own joints, never by
those of another robot.
"""

from __future__ import annotations

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    ENERGY_BOUND,
    GOAL_LOWER,
    GOAL_UPPER,
    REST_RATE,
    REST_REACH,
    track_row,
)
from coop_drake.laws.governor import energy_margin
from coop_drake.tree.pose import FloatArray

__all__ = [
    "CLEARANCE_FRACTION",
    "EROSION",
    "RATE_TOLERANCE",
    "SPEED_TOLERANCE",
    "axis_arrival",
    "axis_ready",
    "clearance_margin",
    "funnel_margin",
    "interval_margin",
    "position_arrival",
    "rest_margin",
]

EROSION = 0.1
"""Fraction of a goal interval's width, at each end, in which an axis does not count as arrived [-]. Erratum
E17b: near the end of its next slice an axis would be accelerated without bound."""

CLEARANCE_FRACTION = 0.5
"""The object must provably stay in the next cell within this fraction of the goal region's inradius [-];
p_G rests at the middle of the goal region, so the condition is met there with the same distance to spare."""

SPEED_TOLERANCE = 0.01
"""Largest speed of the object's origin that counts as rest [m/s]: what a person would call still."""

RATE_TOLERANCE = 0.02
"""Largest rate of an axis that counts as rest [rad/s or m/s]: at half a metre the speed of
``SPEED_TOLERANCE``."""


@compiled
def interval_margin(position: float, lower: float, upper: float, erosion: float = EROSION) -> float:
    """Return by how much an axis is inside its interval eroded at both ends, 1 in the middle.

    Args:
        position: x [rad or m].
        lower: Lower end [rad or m].
        upper: Upper end, above the lower one [rad or m].
        erosion: Fraction of the width that is taken away at each end, below one half [-].
    """
    half = 0.5 * (upper - lower) * (1.0 - 2.0 * erosion)
    return 1.0 - abs(position - 0.5 * (lower + upper)) / half


@compiled
def clearance_margin(margin: float, stiffness: float, inradius: float) -> float:
    """Return (Delta E - floor) / max(|Delta E|, floor), the floor being (K / 2) (R / 2)^2: erratum E10.

    It is positive where the object provably stays in the next cell, and therefore is in it already.

    Args:
        margin: Delta E of the next cell with the next cell's K [m^2/s^2].
        stiffness: The next cell's K [1/s^2].
        inradius: R, distance of the target to the boundary of the goal region [m].
    """
    floor = energy_margin(0.0, CLEARANCE_FRACTION * inradius, stiffness)
    return (margin - floor) / max(abs(margin), floor)


@compiled
def funnel_margin(energy: float, energy_bound: float) -> float:
    """Return (bound - V) / max(V, bound), positive where V lets an axis enter its next funnel.

    Args:
        energy: V of the axis at the beginning of the next funnel, with the next gains [rad^2/s^2 or m^2/s^2].
        energy_bound: Largest V with which that funnel may be entered, in the same unit.
    """
    return (energy_bound - energy) / max(energy, energy_bound)


@compiled
def hand_over_margin(time: float, duration: float) -> float:
    """Return by how much the last hand-over is over, 1 where it takes no time.

    Args:
        time: Time since the cell was entered [s].
        duration: T, in which the commands of the last cell fade [s].
    """
    return min(time / duration - 1.0, 1.0) if duration > 0.0 else 1.0


@compiled
def rest_margin(rate: float) -> float:
    """Return 1 - |x'| / ``RATE_TOLERANCE`` of one axis, positive where it counts as at rest."""
    return 1.0 - abs(rate) / RATE_TOLERANCE


@compiled
def position_arrival(distance: float, speed: float, tolerance: float) -> float:
    """Return by how much the object's origin is at the goal and at rest.

    Args:
        distance: Distance to the goal position [m].
        speed: Speed of the origin [m/s].
        tolerance: Largest distance that counts as arrived, less ``EROSION`` of it [m].
    """
    return min(1.0 - distance / ((1.0 - EROSION) * tolerance), 1.0 - speed / SPEED_TOLERANCE)


@compiled(borrows=True)
def axis_ready(row: FloatArray, next_row: FloatArray, position: float, rate: float) -> float:
    """Return the margin with which one axis may enter the next cell: inside its goal, and V small enough.

    An axis that leaves its cell at rest must instead be near the middle of its goal interval, and slow, as a
    ``RestCondition`` says.

    Args:
        row: The axis in the current cell, a row of an ``axis_table``.
        next_row: The axis in the next cell.
        position: x [rad or m].
        rate: x' [rad/s or m/s].
    """
    if row[REST_RATE] > 0.0:
        away = abs(position - 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER]))
        return float(min(1.0 - away / row[REST_REACH], 1.0 - abs(rate) / row[REST_RATE]))
    energy = track_row(next_row, 0.0, position, rate)[1]
    inside = interval_margin(position, row[GOAL_LOWER], row[GOAL_UPPER])
    return min(inside, funnel_margin(energy, next_row[ENERGY_BOUND]))


@compiled(borrows=True)
def axis_arrival(row: FloatArray, position: float, rate: float) -> float:
    """Return the margin with which, in the last cell, one axis is inside its goal and at rest."""
    inside = interval_margin(position, row[GOAL_LOWER], row[GOAL_UPPER])
    return min(inside, rest_margin(rate))
