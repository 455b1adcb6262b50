"""Shares of the wrench that moves the object, equations (21), (27)-(29) and (31).

All vectors are in W, planar order (x, y, rotation). In the paper the object's origin L is its centre of
mass; here it need not be.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray


@compiled
def rotated(c: float, s: float, x: float, y: float) -> tuple[float, float]:
    """Return the vector (x, y) turned by an angle whose cosine and sine are c and s."""
    return c * x - s * y, s * x + c * y


@compiled
def object_twist(rx: float, ry: float, vx: float, vy: float, w: float) -> tuple[float, float, float]:
    """Return the object's twist A^-1 J z' of (29), as a robot knows it from its own motion.

    Args:
        rx: First coordinate of the grasp from the object's origin [m].
        ry: Second coordinate [m].
        vx: First coordinate of the end effector's velocity [m/s].
        vy: Second coordinate [m/s].
        w: Its angular rate [rad/s].
    """
    return vx + ry * w, vy - rx * w, w


@compiled
def acceleration_at(
    rx: float, ry: float, ax: float, ay: float, alpha: float, w: float
) -> tuple[float, float]:
    """Return the acceleration of a point fixed to the object: A a + (-w^2 r, 0), (27) and (28) [m/s^2].

    Args:
        rx: First coordinate of r, the point from the object's origin [m].
        ry: Second coordinate of r [m].
        ax: First coordinate of the origin's acceleration [m/s^2].
        ay: Second coordinate [m/s^2].
        alpha: Angular acceleration [rad/s^2].
        w: Angular rate [rad/s].
    """
    return ax - alpha * ry - w * w * rx, ay + alpha * rx - w * w * ry


@compiled
def wrench_share(
    px: float, py: float, ax: float, ay: float, alpha: float, mass: float, inertia: float, share: float
) -> tuple[float, float, float]:
    """Return the wrench tau_e that one of N robots applies at its grasp, (21) and (31) with erratum E21.

    tau_e = w (M a_com, I theta'' + P^perp . M a_com), with w = 1 / N in the paper. Wrenches whose w sum to
    one sum to M a_com and I theta'' about the centre of mass, wherever the grasps are.

    Args:
        px: First coordinate of P, the centre of mass from the grasp [m].
        py: Second coordinate of P [m].
        ax: First coordinate of a_com, the desired acceleration of the centre of mass [m/s^2].
        ay: Second coordinate of a_com [m/s^2].
        alpha: Desired angular acceleration theta'' [rad/s^2].
        mass: M [kg].
        inertia: I about the centre of mass [kg m^2].
        share: w, the robot's share of the load, from 0 to 1 [-].

    Returns:
        Force on the object [N, N] and torque about the grasp [N m].
    """
    fx, fy = share * mass * ax, share * mass * ay
    return fx, fy, share * inertia * alpha - py * fx + px * fy


@compiled(borrows=True)
def end_effector_command(
    load: FloatArray, object_state: FloatArray, linear: FloatArray, axes: FloatArray, command: FloatArray
) -> None:
    """Write what one robot's end effector shall do: ``acceleration_at`` its grasp, then its ``wrench_share``.

    Args:
        load: p_LE (2) [m], p_LLcm (2) [m], M [kg], I [kg m^2] and the robot's share of the load, shape (7,).
        object_state: Pose and twist of the object, shape (6,).
        linear: Desired acceleration of the object's origin, shape (2,) [m/s^2].
        axes: Desired angular acceleration of the object [rad/s^2]; those of joints, not used here.
        command: Receives acceleration [m/s^2, rad/s^2] and wrench [N, N m], shape (6,).
    """
    c, s, w = np.cos(object_state[2]), np.sin(object_state[2]), object_state[5]
    ax, ay, alpha = linear[0], linear[1], axes[0]
    rx, ry = rotated(c, s, load[0], load[1])
    mx, my = rotated(c, s, load[2], load[3])
    command[0], command[1] = acceleration_at(rx, ry, ax, ay, alpha, w)
    command[2] = alpha
    bx, by = acceleration_at(mx, my, ax, ay, alpha, w)
    command[3], command[4], command[5] = wrench_share(
        mx - rx, my - ry, bx, by, alpha, load[4], load[5], load[6]
    )


def total_wrench(wrenches: FloatArray, grasps: FloatArray, p_LLcm: FloatArray, angle: float) -> FloatArray:
    """Return the sum of wrenches about the object's centre of mass in W, shape (3,) [N, N m].

    Args:
        wrenches: Wrenches in W, each about its grasp, shape (N, 3) [N, N m].
        grasps: The grasps in L, shape (N, 2) [m].
        p_LLcm: The centre of mass in L, shape (2,) [m].
        angle: Angle of the object [rad].
    """
    c, s, total = cos(angle), sin(angle), np.zeros(3)
    mx, my = rotated(c, s, p_LLcm[0], p_LLcm[1])
    for (fx, fy, torque), grasp in zip(wrenches.tolist(), grasps.tolist(), strict=True):
        rx, ry = rotated(c, s, *grasp)
        total += fx, fy, torque + (rx - mx) * fy - (ry - my) * fx
    return total
