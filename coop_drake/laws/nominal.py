"""Nominal motions of the position and of the axes, which robots compute alike, and how they are tracked."""

from __future__ import annotations

from math import exp

import numpy as np
import scipy

from coop_drake.jit import compiled
from coop_drake.laws.governor import governed_acceleration
from coop_drake.tree.arrays import FloatArray

# The nominal motion of the object's position, which all robots compute alike, and its tracking.
#
# Where a plan has a position tube, p_G does not follow from what is measured. Every robot moves a model of
# the object instead, a point p^ behind p_G,
#
# p^'' = -K (p^ - p_G) - zeta p^',
#
# from sample to sample with p_G at rest in between, and moves p_G by (13)-(16) with p^ in place of p.
# Nothing in this depends on measurements, so that all robots have the same numbers, bit by bit. They pull
# the object to the nominal motion,
#
# p'' = p^'' - K_t (p - p^) - zeta_t (p' - p^'),
#
# each with the nominal state of the instant at which its measurements were made.
#
# Why p^ stays in the governed set: let a = root(|p^ - p_G|^2 + |p^'|^2 / K) = root(2 E / K), E being that
# of (16). While p_G rests, E' = -zeta |p^'|^2, so that a does not grow. A step of p_G by delta changes a,
# and the distance d of p_G to the region's boundary, by at most |delta| each. Steps of at most (d - a) / 2
# therefore keep d - a from becoming negative, and p^, which is within a of p_G, in the region.


def nominal_flow(stiffness: float, damping: float, period: float) -> FloatArray:
    """Return the matrix that carries one coordinate of (p^ - p_G, p^') over a period, shape (2, 2).

    Args:
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        period: T, for which p_G is at rest [s].
    """
    flow: FloatArray = scipy.linalg.expm(period * np.array([[0.0, 1.0], [-stiffness, -damping]]))
    return flow


@compiled(borrows=True)
def track_nominal(
    gains: FloatArray, object_state: FloatArray, governor: FloatArray, nominal: FloatArray,
    expected: FloatArray, acceleration: FloatArray,
) -> None:  # fmt: skip
    """Write the object's desired acceleration: that of p^, and the pull towards it, shape (2,) [m/s^2].

    Args:
        gains: K, zeta, K_t and zeta_t, shape (4,).
        object_state: Pose and twist of the object as measured, shape (6,).
        governor: p_G, shape (2,) [m].
        nominal: p^ and p^' now, shape (4,) or longer.
        expected: p^ and p^' when the object was measured, shape (4,) or longer.
        acceleration: Receives it.
    """
    for i in range(2):
        away, fast = object_state[i] - expected[i], object_state[3 + i] - expected[2 + i]
        own = governed_acceleration(nominal[i], nominal[2 + i], governor[i], gains[0], gains[1])
        acceleration[i] = own + governed_acceleration(away, fast, 0.0, gains[2], gains[3])


# The nominal motion of an axis, which all robots that know the axis compute alike, and its tracking.
#
# Where a plan has a budget for the axes, the law (17)-(20), (35)-(39) does not act on what is measured.
# Every robot moves a model of the object's angle and of its joints, an axis x^ that is commanded by this
# law,
#
# x^'' = a^, lag a^' = L(t, x^, x^') - a^,
#
# the command being held over a control period and followed with the lag of the actuators. Nothing in this
# depends on measurements: all robots have the same numbers, and no noise reaches the law. They pull the
# axis to its nominal motion by the command
#
# u = L(t, x^, x^') - K_a (x - x^) - zeta_a (x' - x^'),
#
# each with the nominal state of the instant at which its measurements were made. The departure x - x^ obeys
# a linear equation that does not vary in time, whatever the law.
#
# The angles and rates with which desired accelerations become efforts are nominal ones, too: the base of a
# robot turns with the object and against its joints, so that its yaw follows from its axes.


@compiled
def lag_factors(period: float, lag: float) -> tuple[float, float, float]:
    """Return what a command u held over a period leaves of a - u: in a [-], in x' [s] and in x [s^2].

    The acceleration a follows the command with the time constant ``lag``.
    """
    if lag == 0.0:
        return 0.0, 0.0, 0.0
    left = exp(-period / lag)
    return left, lag * (1.0 - left), lag * period - lag * lag * (1.0 - left)


@compiled(borrows=True)
def carry_axes(
    state: FloatArray, commands: FloatArray, period: float, lag: float, following: FloatArray
) -> None:
    """Write the nominal state of some axes a period later.

    Args:
        state: x^ [rad or m], x^' and a^ of every axis, shape (3, m).
        commands: L of every axis, held over the period, shape (m,) [rad/s^2 or m/s^2].
        period: T [s].
        lag: Time constant of the actuators [s].
        following: Receives the state, shape (3, m).
    """
    left, in_v, in_x = lag_factors(period, lag)
    for i in range(commands.size):
        x, v, u, gap = state[0, i], state[1, i], commands[i], state[2, i] - commands[i]
        following[0, i] = x + period * v + 0.5 * period * period * u + in_x * gap
        following[1, i] = v + period * u + in_v * gap
        following[2, i] = u + left * gap


@compiled(borrows=True)
def pull_axes(
    commands: FloatArray,
    object_state: FloatArray,
    robot_state: FloatArray,
    expected: FloatArray,
    gains: tuple[float, float],
    pulled: FloatArray,
) -> None:
    """Write u, the commands of one robot's axes with the pull towards their nominal motion.

    Args:
        commands: L(t, x^, x^') of the object's angle and of the joints now, [rad/s^2 or m/s^2], (1 + n,).
        object_state: Pose and twist of the object as measured, shape (6,).
        robot_state: (z_k, z_k') as measured, shape (2 (3 + n),); not read where the robot has no joints.
        expected: x^ and x^' of the axes when these were measured, shape (2, 1 + n).
        gains: K_a [1/s^2] and zeta_a [1/s].
        pulled: Receives u, shape (1 + n,) [rad/s^2 or m/s^2].
    """
    n = commands.size - 1
    for i in range(1 + n):
        x = robot_state[2 + i] if i else object_state[2]
        rate = robot_state[5 + n + i] if i else object_state[5]
        away, fast = x - expected[0, i], rate - expected[1, i]
        pulled[i] = commands[i] + governed_acceleration(away, fast, 0.0, gains[0], gains[1])
