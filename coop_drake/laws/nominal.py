"""Nominal motions of the position and of the axes, which robots compute alike, and how they are tracked."""

from __future__ import annotations

from math import exp, hypot, sqrt

import numpy as np
import scipy

from coop_drake.jit import compiled
from coop_drake.laws.governor import ATTRACTION_RATE, governed_acceleration, tracking_energy
from coop_drake.tree.pose import FloatArray

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


@compiled
def excursion(x: float, y: float, vx: float, vy: float, stiffness: float) -> float:
    """Return a = root(2 E / K), from which p^ is not farther from p_G until p_G moves [m].

    Args:
        x: First coordinate of p^ - p_G [m].
        y: Second coordinate [m].
        vx: First coordinate of p^' [m/s].
        vy: Second coordinate [m/s].
        stiffness: K [1/s^2].
    """
    return sqrt(2.0 * tracking_energy(x, y, vx, vy, stiffness) / stiffness)


@compiled
def limited_step(vx: float, vy: float, period: float, speed: float, room: float) -> tuple[float, float]:
    """Return the step of p_G in a period, T p_G', no longer than T times a speed and half the room [m].

    Args:
        vx: First coordinate of p_G' of (14) [m/s].
        vy: Second coordinate [m/s].
        period: T [s].
        speed: Largest speed of p_G [m/s].
        room: d - a [m].
    """
    length = period * hypot(vx, vy)
    allowed = min(period * speed, 0.5 * max(room, 0.0))
    scale = period if length <= allowed else period * allowed / length
    return scale * vx, scale * vy


@compiled
def reach_of(distance: float, period: float, periods: float, speed: float) -> float:
    """Return the longest way that p_G can go in some periods [m].

    The field (13) moves p_G by at most ``ATTRACTION_RATE`` times its distance from the target, which with
    every step can grow by as much.

    Args:
        distance: Distance of p_G from the target [m].
        period: T [s].
        periods: Number of periods [-].
        speed: Largest speed of p_G [m/s].
    """
    growth: float = (1.0 + ATTRACTION_RATE * period) ** periods - 1.0
    return min(periods * period * speed, distance * growth)


@compiled(borrows=True)
def tracked_acceleration(
    position: float,
    velocity: float,
    governor_position: float,
    nominal: tuple[float, float],
    expected: tuple[float, float],
    gains: tuple[float, float, float, float],
) -> float:
    """Return one coordinate of the object's desired acceleration: that of p^, and the pull towards it.

    Args:
        position: Coordinate of p as measured [m].
        velocity: The same coordinate of p' as measured [m/s].
        governor_position: The same coordinate of p_G [m].
        nominal: p^ and p^' now [m, m/s].
        expected: p^ and p^' when p and p' were measured [m, m/s].
        gains: K [1/s^2], zeta [1/s], K_t [1/s^2], zeta_t [1/s].
    """
    own = governed_acceleration(nominal[0], nominal[1], governor_position, gains[0], gains[1])
    pull = governed_acceleration(position - expected[0], velocity - expected[1], 0.0, gains[2], gains[3])
    return own + pull


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
def pulled_axis(
    command: float, position: float, rate: float, expected: tuple[float, float], gains: tuple[float, float]
) -> float:
    """Return u, the command of one axis with the pull towards its nominal motion [rad/s^2 or m/s^2].

    Args:
        command: L(t, x^, x^') now [rad/s^2 or m/s^2].
        position: x as measured [rad or m].
        rate: x' as measured [rad/s or m/s].
        expected: x^ and x^' when these were measured.
        gains: K_a [1/s^2] and zeta_a [1/s].
    """
    away, fast = position - expected[0], rate - expected[1]
    return command + governed_acceleration(away, fast, 0.0, gains[0], gains[1])


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
        pulled[i] = pulled_axis(commands[i], x, rate, (expected[0, i], expected[1, i]), gains)


@compiled(borrows=True)
def place_on_axes(axes: FloatArray, mounting: FloatArray, robot_state: FloatArray) -> None:
    """Write the angles of a robot whose object and joints stand and move as given: yaw, joints, and rates.

    Its base turns with the object and against its joints: yaw = theta + offset + sum of turn_i q_i. The
    base's position and velocity are left as they are.

    Args:
        axes: (theta, q_k) and their rates, shape (2, 1 + n) or more rows.
        mounting: Yaw of the base in the object where all joints are at zero [rad], then what a unit of every
            joint turns the base by in the object [-], shape (1 + n,).
        robot_state: (z_k, z_k'), shape (2 (3 + n),).
    """
    n, half = axes.shape[1] - 1, 2 + axes.shape[1]
    for row in range(2):
        yaw = axes[row, 0] + (mounting[0] if row == 0 else 0.0)
        for i in range(1, 1 + n):
            yaw += mounting[i] * axes[row, i]
            robot_state[row * half + 2 + i] = axes[row, i]
        robot_state[row * half + 2] = yaw
