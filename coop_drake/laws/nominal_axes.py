"""The nominal motion of an axis, which all robots that know the axis compute alike, and its tracking.

Where a plan has a budget for the axes, the law (17)-(20), (35)-(39) does not act on what is measured. Every
robot moves a model of the object's angle and of its joints, an axis x^ that is commanded by this law,

    x^'' = a^,  lag a^' = L(t, x^, x^') - a^,

the command being held over a control period and followed with the lag of the actuators. Nothing in this
depends on measurements: all robots have the same numbers, and no noise reaches the law. They pull the axis
to its nominal motion by the command

    u = L(t, x^, x^') - K_a (x - x^) - zeta_a (x' - x^'),

each with the nominal state of the instant at which its measurements were made. The departure x - x^ obeys a
linear equation that does not vary in time, whatever the law.

The angles and rates with which desired accelerations become efforts are nominal ones, too: the base of a
robot turns with the object and against its joints, so that its yaw follows from its axes.
"""

from __future__ import annotations

from math import exp

from coop_drake.jit import compiled
from coop_drake.laws.governor import governed_acceleration
from coop_drake.tree.pose import FloatArray


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
