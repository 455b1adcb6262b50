"""The nominal motion of a team that passes from cell to cell, and the feedback that keeps the team on it.

All robots know the motion z(sigma), a spline, and follow it at the same phase sigma, whose rate is the pace
rho, 1 but where the team brakes or starts. The desired acceleration of every axis x of (x, y, theta, q) is
the nominal one and a proportional-derivative feedback,

x^'' - K_t (x - x^) - zeta_t (x' - x^'),  x^' = rho z',  x^'' = rho^2 z'' + rho' z',

so that its departure from the motion (the tracking error) obeys a linear equation that does not vary in time.
In a sampled team x and x' are compared with the motion when they were measured. x^'' is that half a period
and a lag after the sample, when the effort acts on average; so are the angles and rates with which desired
accelerations become efforts.
"""

from __future__ import annotations

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray


@compiled
def motion_at(
    points: FloatArray, period: float, phase: float, pace: float, pace_rate: float, nominal: FloatArray
) -> None:
    """Write the nominal configuration, its rate and its acceleration.

    Args:
        points: Control points of a cubic B-spline with equal spans, shape (m, d).
        period: Time of a span [s].
        phase: sigma; before the beginning and after the end the motion is at rest [s].
        pace: rho [-].
        pace_rate: rho' [1/s].
        nominal: Receives x^, x^' and x^'', shape (3, d).
    """
    spans = points.shape[0] - 3
    place = min(max(phase / period, 0.0), float(spans))
    span = min(int(place), spans - 1)
    u = place - span
    w = 1.0 - u
    for k in range(points.shape[1]):
        a, b, c, d = points[span, k], points[span + 1, k], points[span + 2, k], points[span + 3, k]
        value = w**3 * a + (3.0 * u**3 - 6.0 * u * u + 4.0) * b + (3.0 * w**3 - 6.0 * w * w + 4.0) * c
        rate = (0.5 * (w * w * (b - a) + u * u * (d - c)) + (0.5 + u * w) * (c - b)) / period
        nominal[0, k] = (value + u**3 * d) / 6.0
        nominal[1, k] = pace * rate
        bend = (w * (a - 2.0 * b + c) + u * (b - 2.0 * c + d)) / (period * period)
        nominal[2, k] = pace * pace * bend + pace_rate * rate


@compiled(borrows=True)
def pull(
    ahead: FloatArray, expected: FloatArray, joints: IntArray, gains: FloatArray, object_state: FloatArray,
    robot_state: FloatArray, accelerations: FloatArray,
) -> None:  # fmt: skip
    """Write the desired accelerations of (x, y, theta) and of one robot's joints, shape (3 + n,).

    Each is that of the motion when the command acts, and the pull to the motion when x was measured.

    Args:
        ahead: What ``motion_at`` writes for the time at which the command acts, on average.
        expected: What it writes for the time of the measurement.
        joints: Where the robot's joints stand in (x, y, theta, q), shape (n,).
        gains: K_t [1/s^2] and zeta_t [1/s] of the position, then of the angle and the joints, shape (4,).
        object_state: Pose and twist of the object as measured, shape (6,).
        robot_state: (z_k, z_k') as measured, shape (2 (3 + n),); not read where the robot has no joints.
        accelerations: Receives them [m/s^2, rad/s^2].
    """
    n = joints.size
    for i in range(3 + n):
        axis, x, rate = i, 0.0, 0.0
        if i < 3:
            x, rate = object_state[i], object_state[3 + i]
        else:
            axis, x, rate = joints[i - 3], robot_state[i], robot_state[3 + n + i]
        k = 0 if i < 2 else 2
        off, fast = x - expected[0, axis], rate - expected[1, axis]
        accelerations[i] = ahead[2, axis] - gains[k] * off - gains[k + 1] * fast


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
