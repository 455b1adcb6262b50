"""Actuators: limits and lag, brakes, and how a cell is begun anew after a stop."""

from __future__ import annotations

from math import ceil, copysign, exp, hypot, inf, pi, sqrt, tau
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import DECAY_RATE, FADING_TIME, RAMP_RATE
from coop_drake.laws.ppc import CLOSING
from coop_drake.tree.arrays import FloatArray

# How the efforts of actuators follow what is asked of them.


@compiled(borrows=True)
def limit_efforts(limits: FloatArray, efforts: FloatArray) -> None:
    """Cut the efforts of one robot to what its actuators can give; a base's force keeps its direction.

    Args:
        limits: Largest length of the base's force, largest torque, largest efforts of the joints, (2 + n,).
        efforts: Base wrench and joint torques, shape (3 + n,) [N, N m]; those that are too large change.
    """
    if hypot(efforts[0], efforts[1]) > limits[0]:
        largest = max(abs(efforts[0]), abs(efforts[1]))
        for i in range(2):  # a lost run may ask for infinite forces
            finite = efforts[i] / largest if largest < inf else 0.0
            efforts[i] = copysign(1.0, efforts[i]) if abs(efforts[i]) == inf else finite
        shorter = limits[0] / hypot(efforts[0], efforts[1])
        efforts[0] *= shorter
        efforts[1] *= shorter
    for i in range(1, limits.size):
        efforts[1 + i] = min(max(efforts[1 + i], -limits[i]), limits[i])


@compiled(borrows=True)
def lag_behind(lag: float, elapsed: float, held: FloatArray, before: FloatArray, given: FloatArray) -> None:
    """Write the efforts of actuators that are first-order low passes: y = u + exp(-t / T) (y_0 - u).

    The formula is exact where the effort asked for is held.

    Args:
        lag: Time constant T [s]; 0 for actuators that follow at once.
        elapsed: Time t since ``before`` acted [s].
        held: Efforts u that are asked for since then, shape (m,) [N, N m].
        before: Efforts y_0 that acted then, shape (m,).
        given: Receives the efforts y that act now, shape (m,).
    """
    left = exp(-elapsed / lag) if lag > 0.0 else 0.0
    for i in range(held.size):
        given[i] = held[i] + left * (before[i] - held[i])


# How a robot stops by itself when its team is not complete: every effort works against its own rate.
#
# Where a robot has told its drives a rest, they pull towards it, too, z being the robot's own coordinates:
#
# effort = -D (z' + kappa (z - z_rest)).
#
# Damper and spring take energy out of the team whatever its masses are, for -D z' has negative power and
# the spring has a potential. All robots follow the same nominal motion and so name rests that fit each
# other: the team comes to rest where this motion was, which is inside its cell.
#
# Drives that are limited cut the damper's part and the spring's part to half of each limit, so that their
# sum is never beyond it. Cut by itself, the damper still has negative power, and the spring a potential.

BASE_RATE = 100.0 / 6.0
"""Force on a base for each unit of its momentum [1/s]: it would stop alone within 0.2 s, with its load within
0.3 s, and efforts that are held for 5 ms and rest on measurements of 10 ms ago still take energy away."""

TURN_RATE = 1.0 / 0.1875
"""Torque on a base for each unit of its own angular momentum [1/s]. A larger one would, with measurements as
old, add energy to arms that turn with a base and have less inertia, as the elbows' have."""

JOINT_DAMPING = 1.0
"""Effort of a joint for each unit of its rate [N m s/rad or N s/m], for links from 0.1 kg m^2 or kg on with
measurements as old; lighter ones need fresher measurements."""


RETURN_RATE = 4.0
"""kappa [1/s]: a team of bases of 6 kg with their load, whose damping is 12 /s, overshoots its rest by less
than it would coast."""


class Brake(NamedTuple):
    """How the drives of one robot brake.

    Attributes:
        damping: D, from :func:`braking_damping`, shape (3 + n,).
        limits: Largest length of the base's force, largest torque and largest efforts of the joints, infinite
            for none, shape (2 + n,) [N, N m].
    """

    damping: FloatArray
    limits: FloatArray


def braking_damping(mass: float, inertia: float, joints: int) -> FloatArray:
    """Return base wrench and joint torques for each unit of the rates, shape (3 + n,).

    Args:
        mass: Mass of the base [kg].
        inertia: Its inertia about the vertical axis through the origin of Bk [kg m^2].
        joints: Number n of joints.
    """
    return np.array([BASE_RATE * mass, BASE_RATE * mass, TURN_RATE * inertia, *[JOINT_DAMPING] * joints])


def braking_effort(state: FloatArray, brake: Brake, rest: FloatArray | None = None) -> FloatArray:
    """Return base wrench and joint torques that brake a robot, within its limits, shape (3 + n,) [N, N m].

    A team in which all robots brake loses energy, but for the age of measurements, and comes to rest.

    Args:
        state: z_k and its rate, shape (2 (3 + n),).
        brake: How its drives brake.
        rest: Where it shall come to rest, z_k of shape (3 + n,); None where that is not known.
    """
    half, halved = len(state) // 2, 0.5 * brake.limits
    effort = -brake.damping * state[half:]
    limit_efforts(halved, effort)
    if rest is None:
        return effort
    away = state[:half] - rest
    away[2:] = (away[2:] + pi) % tau - pi  # a rest is never half a turn away; sensors may show any turn
    pull = -RETURN_RATE * brake.damping * away
    limit_efforts(halved, pull)
    return effort + pull


# How a team begins its current cell anew from rest: slowly, on a straight way to the middle of its goals.
#
# Every axis goes from where it rests to the middle of its goal interval, in the same time for all axes of
# the team, by
#
# x(t) = x_0 + (x_1 - x_0) s(t / S), s(r) = 10 r^3 - 15 r^4 + 6 r^5,
#
# whose largest rate is 1.875 |x_1 - x_0| / S and whose largest acceleration 5.774 |x_1 - x_0| / S^2.
# Meanwhile the object's position rests, or returns to its cell in the same way where it is outside. Then
# the cell's law takes over: its funnels are closed about the axes, and p_G goes to the target.
#
# A cell is convex in its axes: from a rest inside the slices the way lies inside.

RATE = 0.4
"""Largest rate of an axis on the way, and largest speed of the object [rad/s or m/s]: a fifth to a tenth of
what funnels ask for, so that rates and errors of masses cause little."""

ACCELERATION = 1.0
"""Largest acceleration of an axis on the way [rad/s^2 or m/s^2]."""

USED = 0.9
"""Share of both for which the time is chosen [-]: the rest is for what a motion makes up for on its way."""

PULL = (100.0, 20.0)
"""Stiffness [1/s^2] and damping [1/s] with which an axis is kept on the way."""

LONGEST_RETURN = 0.3
"""Longest way on which an object outside its cell returns [m]: braked teams coast by less."""

WIDEST_RETURN = 1.0
"""Longest way of an axis to its slice, over the slice's width [-]: farther away no certificate says anything
about what is free."""

RAMPED = 6.0
"""mu t from which on the gain k1 counts as ramped in [-]."""


def slow_samples(distance: float, period: float) -> int:
    """Return how many periods a way takes [-].

    Args:
        distance: Largest distance of an axis, or of the object [rad or m].
        period: T [s].
    """
    time = max(1.875 * distance / (USED * RATE), sqrt(5.774 * distance / (USED * ACCELERATION)))
    return ceil(time / period) + 1


def slow_motion(ends: FloatArray, time: float, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, x' and x'' at a time of the way, each of shape (m,).

    Args:
        ends: x_0 and x_1, shape (2, m) [rad or m].
        time: t, any; before 0 and after S all rest [s].
        duration: S [s].
    """
    r, way = min(max(time / duration, 0.0), 1.0), ends[1] - ends[0]
    share = r**3 * (10.0 - 15.0 * r + 6.0 * r * r)
    rate = 30.0 * r * r * (1.0 - r) ** 2 / duration
    acceleration = 60.0 * r * (1.0 - r) * (1.0 - 2.0 * r) / duration**2
    return ends[0] + share * way, rate * way, acceleration * way


def closed_after(table: FloatArray) -> float:
    """Return the time after which all funnels of a cell are closed, gains ramped and jumps faded [s].

    Args:
        table: The axes in the cell, an ``axis_table``.
    """
    closed = (CLOSING / table[:, DECAY_RATE]).max()
    ramped = max((RAMPED / rate for rate in table[:, RAMP_RATE] if rate > 0.0), default=0.0)
    return float(max(closed, ramped, table[:, FADING_TIME].max()))
