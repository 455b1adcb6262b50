"""The equations of one robot and of a grasp with matrices, which the compiled laws are compared with.

The robot's coordinates are z = (x, y, yaw, q...), so its Jacobian splits into J = [J_b, J_q] with J_b (3,
3). J_b is invertible for every holonomic base.
"""

from __future__ import annotations

import numpy as np


def robot_acceleration(end_effector_acceleration, joint_acceleration, *, jacobian, jacobian_rate_term):
    """Return z'' that gives the end effector and the joints the accelerations asked for, shape (3 + n,).

    Args:
        end_effector_acceleration: x''_E in W, shape (3,) [m/s^2, rad/s^2].
        joint_acceleration: q'', shape (n,).
        jacobian: J of the end effector in W, shape (3, 3 + n).
        jacobian_rate_term: J' z', shape (3,).
    """
    wanted = end_effector_acceleration - jacobian_rate_term - jacobian[:, 3:] @ joint_acceleration
    return np.concatenate([np.linalg.solve(jacobian[:, :3], wanted), joint_acceleration])


def consistent_projector(mass_matrix, jacobian):
    """Return I - J^T (J M^-1 J^T)^-1 J M^-1, the projector that (23) means: erratum E23.

    Generalized forces that pass through it do not accelerate the end effector. Through I - J^+ J, as
    printed, they do, because J M^-1 (I - J^+ J) is not zero.
    """
    mobility = np.linalg.solve(mass_matrix, jacobian.T)
    return np.eye(mass_matrix.shape[0]) - jacobian.T @ np.linalg.solve(jacobian @ mobility, mobility.T)


def grasp_matrix(offset):
    """Return A = [[I, r^perp], [0, 1]], shape (3, 3): it takes the object's twist to the grasp's, (27)."""
    return np.array([[1.0, 0.0, -offset[1]], [0.0, 1.0, offset[0]], [0.0, 0.0, 1.0]])


def turned(angle, vector):
    """Return R(angle) vector, shape (2,)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ vector
