"""What one robot's actuators do, equations (22)-(34) corrected: errata E23, E25, E33.

The robot's coordinates are z = (x, y, yaw, q...), so its Jacobian splits into J = [J_b, J_q] with J_b (3, 3).
J_b is invertible for every holonomic base: the joints may accelerate as they like, the base makes up for it.
"""

from __future__ import annotations

import numpy as np

from coop_drake.laws.gains import FloatArray


def robot_acceleration(
    end_effector_acceleration: FloatArray,
    joint_acceleration: FloatArray,
    *,
    jacobian: FloatArray,
    jacobian_rate_term: FloatArray,
) -> FloatArray:
    """Return z'' that gives the end effector and the joints the accelerations asked for.

    The base takes J_b^-1 (x''_E - J' z' - J_q q'').

    Args:
        end_effector_acceleration: x''_E in W, shape (3,) [m/s^2, rad/s^2].
        joint_acceleration: q'', shape (n,).
        jacobian: J of the end effector in W, shape (3, 3 + n).
        jacobian_rate_term: J' z', shape (3,).

    Returns:
        z'', shape (3 + n,).
    """
    wanted = end_effector_acceleration - jacobian_rate_term - jacobian[:, 3:] @ joint_acceleration
    return np.concatenate([np.linalg.solve(jacobian[:, :3], wanted), joint_acceleration])


def robot_torque(
    acceleration: FloatArray,
    wrench: FloatArray,
    *,
    mass_matrix: FloatArray,
    bias: FloatArray,
    jacobian: FloatArray,
) -> FloatArray:
    """Return tau_m = M z'' + C z' + G + J^T tau_e of (22).

    Args:
        acceleration: z'', shape (3 + n,).
        wrench: tau_e that the robot applies to the object at E, shape (3,) [N, N m].
        mass_matrix: M, shape (3 + n, 3 + n).
        bias: C z' + G, shape (3 + n,).
        jacobian: J, shape (3, 3 + n).

    Returns:
        Generalized forces (base wrench in W, joint torques), shape (3 + n,) [N, N m].
    """
    return mass_matrix @ acceleration + bias + jacobian.T @ wrench


def consistent_projector(mass_matrix: FloatArray, jacobian: FloatArray) -> FloatArray:
    """Return I - J^T (J M^-1 J^T)^-1 J M^-1, the projector that (23) means: erratum E23.

    Generalized forces that pass through it do not accelerate the end effector; through I - J^+ J, as printed,
    they do, because J M^-1 (I - J^+ J) is not zero.

    Args:
        mass_matrix: M, shape (m, m).
        jacobian: J, shape (3, m), of full rank.

    Returns:
        Projector on generalized forces, shape (m, m).
    """
    mobility = np.linalg.solve(mass_matrix, jacobian.T)
    return np.eye(mass_matrix.shape[0]) - jacobian.T @ np.linalg.solve(jacobian @ mobility, mobility.T)
