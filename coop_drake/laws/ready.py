"""When a robot says that it is ready to leave a cell, or that the goal is reached (after (10)-(12)).

Every margin is a pure number, positive where the condition holds and 1 at its best; the margin of several is
the smallest. Each robot judges by the object's pose, its own governor and its own joints, never by another's.
"""

from __future__ import annotations

import numpy as np

from coop_drake.laws import kernels
from coop_drake.laws.funnels import Funnel
from coop_drake.laws.gains import FloatArray, TransitionGains
from coop_drake.laws.governor import energy_margin, tracking_energy

#: Part of a goal interval's width, at each end, in which an axis does not count as arrived: erratum E17b.
EROSION = 0.1
#: Part of the goal region's inradius within which the object must provably stay in the next cell.
CLEARANCE_FRACTION = 0.5
#: Largest speed of the object's origin at rest [m/s] ...
SPEED_TOLERANCE = 0.01
#: ... and largest rate of any axis [rad/s or m/s].
RATE_TOLERANCE = 0.02


def interval_margin(
    position: FloatArray, lower: FloatArray, upper: FloatArray, *, erosion: float = EROSION
) -> float:
    """Return by how much every axis is inside its interval eroded at both ends, 1 in the middle.

    Args:
        position: Axes (theta, q...), shape (m,) [rad or m].
        lower: Lower ends, shape (m,).
        upper: Upper ends, above the lower ones, shape (m,).
        erosion: Part of the width taken away at each end, below one half.
    """
    return kernels.interval_margin(position, lower, upper, erosion)


def clearance_margin(margin: float, *, stiffness: float, inradius: float) -> float:
    """Return 1 - floor / Delta E of the next cell, the floor being (K / 2) (R / 2)^2: erratum E10.

    It is positive where the object provably stays in the next cell, and so is in it already.

    Args:
        margin: Delta E of the next cell with the next cell's K [m^2/s^2].
        stiffness: The next cell's K [1/s^2].
        inradius: R, distance of the target to the boundary of the goal region [m].
    """
    floor = energy_margin(0.0, CLEARANCE_FRACTION * inradius, stiffness=stiffness)
    return (margin - floor) / max(abs(margin), floor)


def funnel_margin(position: FloatArray, rate: FloatArray, *, funnel: Funnel, gains: TransitionGains) -> float:
    """Return by how much the energy V of every axis stays below its bound at the mouth of the next funnel.

    Args:
        position: Axes (theta, q...), shape (m,) [rad or m].
        rate: Their rates, shape (m,).
        funnel: The next transition's funnels of these axes.
        gains: The next transition's gains of these axes.
    """
    return kernels.funnel_margin(
        *funnel.kernel_arguments,
        position,
        rate,
        gains.log_gain,
        gains.position_gain,
        gains.energy_bound,
    )


def ready_margin(
    *,
    position: FloatArray,
    velocity: FloatArray,
    governor_position: FloatArray,
    next_clearance: float,
    inradius: float,
    axis_position: FloatArray,
    axis_rate: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    next_funnel: Funnel,
    next_gains: TransitionGains,
) -> float:
    """Return the margin by which one robot is ready to enter the next cell; ready where it is not negative.

    Args:
        position: p of the object in W, shape (2,) [m].
        velocity: p', shape (2,) [m/s].
        governor_position: p_G in W, shape (2,) [m].
        next_clearance: Signed distance of p_G to the boundary of the next cell, positive inside [m].
        inradius: R of the present transition [m].
        axis_position: (theta, own joints), shape (m,) [rad or m].
        axis_rate: Their rates, shape (m,).
        goal_lower: Lower ends of the present goal intervals of these axes, shape (m,).
        goal_upper: Upper ends, shape (m,).
        next_funnel: The next transition's funnels of these axes.
        next_gains: The next transition's gains, selected for these axes.
    """
    stiffness = next_gains.stiffness
    energy = tracking_energy(position, velocity, governor_position, stiffness=stiffness)
    margin = energy_margin(energy, next_clearance, stiffness=stiffness)
    return min(
        interval_margin(axis_position, goal_lower, goal_upper),
        clearance_margin(margin, stiffness=stiffness, inradius=inradius),
        funnel_margin(axis_position, axis_rate, funnel=next_funnel, gains=next_gains),
    )


def arrival_margin(
    *,
    position: FloatArray,
    velocity: FloatArray,
    target: FloatArray,
    axis_position: FloatArray,
    axis_rate: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    position_tolerance: float,
    speed_tolerance: float = SPEED_TOLERANCE,
    rate_tolerance: float = RATE_TOLERANCE,
) -> float:
    """Return the margin by which, in the last cell, one robot sees the goal reached and the motion ended.

    Args:
        position: p of the object in W, shape (2,) [m].
        velocity: p', shape (2,) [m/s].
        target: Goal position in W, shape (2,) [m].
        axis_position: (theta, own joints), shape (m,) [rad or m].
        axis_rate: Their rates, shape (m,).
        goal_lower: Lower ends of the goal intervals, goal less tolerance or the slice where free, shape (m,).
        goal_upper: Upper ends, shape (m,).
        position_tolerance: Largest distance to the target [m].
        speed_tolerance: Largest speed of the object's origin [m/s].
        rate_tolerance: Largest rate of any axis [rad/s or m/s].
    """
    distance = float(np.hypot(position[0] - target[0], position[1] - target[1]))
    speed = float(np.hypot(velocity[0], velocity[1]))
    return min(
        interval_margin(axis_position, goal_lower, goal_upper),
        1.0 - distance / ((1.0 - EROSION) * position_tolerance),
        1.0 - speed / speed_tolerance,
        1.0 - float(np.max(np.abs(axis_rate))) / rate_tolerance,
    )
