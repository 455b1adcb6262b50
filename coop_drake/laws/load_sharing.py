"""Shares of the wrench that moves the object, equations (21) and (31).

All vectors are in W, planar order (x, y, rotation). ``offset`` is the position of a grasp E_k from the
object's origin L, ``com_offset`` that of its centre of mass. In the paper L is the centre of mass; here
it need not be.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from coop_drake.laws.gains import FloatArray


def rotate(angle: float, vector: FloatArray) -> FloatArray:
    """Return R(angle) vector, shape (2,): the step from offsets measured in L to offsets measured in W."""
    c, s, x, y = cos(angle), sin(angle), vector[0], vector[1]
    return np.array([c * x - s * y, s * x + c * y])


def grasp_matrix(offset: FloatArray) -> FloatArray:
    """Return A = [[I, r^perp], [0, 1]], shape (3, 3): it takes the object's twist to the grasp's, (27)."""
    return np.array([[1.0, 0.0, -offset[1]], [0.0, 1.0, offset[0]], [0.0, 0.0, 1.0]])


def object_twist(offset: FloatArray, end_effector_twist: FloatArray) -> FloatArray:
    """Return the object's twist A^-1 J z' as a robot knows it from its own motion, shape (3,).

    Args:
        offset: r, grasp from the object's origin, shape (2,) [m].
        end_effector_twist: J z', (velocity of E, angular rate), shape (3,) [m/s, rad/s].
    """
    vx, vy, w = end_effector_twist
    return np.array([vx + offset[1] * w, vy - offset[0] * w, w])


def acceleration_at(acceleration: FloatArray, angular_rate: float, offset: FloatArray) -> FloatArray:
    """Return the acceleration of a point fixed to the object: A a + (-w^2 r, 0), (28).

    Args:
        acceleration: (p'', theta'') of the object's origin, shape (3,) [m/s^2, rad/s^2].
        angular_rate: w [rad/s].
        offset: r, the point from the object's origin, shape (2,) [m].

    Returns:
        (linear, angular) acceleration at the point, shape (3,).
    """
    ax, ay, alpha = acceleration
    centripetal = angular_rate * angular_rate
    return np.array(
        [
            ax - alpha * offset[1] - centripetal * offset[0],
            ay + alpha * offset[0] - centripetal * offset[1],
            alpha,
        ]
    )


def wrench_share(
    acceleration: FloatArray,
    angular_rate: float,
    offset: FloatArray,
    *,
    com_offset: FloatArray,
    mass: float,
    inertia: float,
    share: float,
) -> FloatArray:
    """Return the wrench tau_e that one of N robots applies at its grasp, (21) and (31), erratum E21.

    tau_e = w (M a_com, I theta'' + P^perp . M a_com), with P = com_offset - offset, the centre of mass from
    the contact; w = 1 / N in the paper. Wrenches whose w sum to one sum to M a_com and I theta'' about the
    centre of mass, wherever the grasps are.

    Args:
        acceleration: Desired (p'', theta'') of the object's origin, shape (3,) [m/s^2, rad/s^2].
        angular_rate: w of the object [rad/s].
        offset: Grasp from the object's origin, shape (2,) [m].
        com_offset: Centre of mass from the object's origin, shape (2,) [m].
        mass: M [kg].
        inertia: I about the centre of mass [kg m^2].
        share: w, the robot's part of the work, in [0, 1].

    Returns:
        (force, torque about the grasp) on the object, shape (3,) [N, N m].
    """
    ax, ay, alpha = acceleration_at(acceleration, angular_rate, com_offset)
    fx, fy = share * mass * ax, share * mass * ay
    px, py = com_offset[0] - offset[0], com_offset[1] - offset[1]
    return np.array([fx, fy, share * inertia * alpha - py * fx + px * fy])


def total_wrench(wrenches: FloatArray, offsets: FloatArray, *, com_offset: FloatArray) -> FloatArray:
    """Return the sum, about the centre of mass, of wrenches (N, 3) applied at offsets (N, 2), shape (3,)."""
    r = offsets - com_offset
    torque = wrenches[:, 2] + r[:, 0] * wrenches[:, 1] - r[:, 1] * wrenches[:, 0]
    return np.array([wrenches[:, 0].sum(), wrenches[:, 1].sum(), torque.sum()])
