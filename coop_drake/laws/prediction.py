"""A predictor: the present state from delayed measurements and from what was commanded since."""

from __future__ import annotations

import numpy as np

from coop_drake.laws.chain_motion import motion_room
from coop_drake.laws.load_sharing import end_effector_command
from coop_drake.laws.robot_dynamics import base_acceleration, estimate_object
from coop_drake.tree.pose import FloatArray


def predict(
    chain: FloatArray,
    p_LE: FloatArray,
    robot: FloatArray,
    pose: FloatArray,
    accelerations: FloatArray,
    period: float,
    predicted: FloatArray,
    predicted_pose: FloatArray,
) -> None:
    """Write a robot's state and the object's pose as many periods later as accelerations are given.

    The law makes every coordinate a double integrator, whose acceleration a is constant for a period T:
    x + T x' + T^2 a / 2 and x' + T a.

    Args:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        robot: (z_k, z_k') as measured, shape (2 (3 + n),).
        pose: Pose of the object as measured, shape (3,) [m, rad].
        accelerations: For each period since, from the first on, those of the object and of z_k, shape
            (periods, 6 + n) [m/s^2 or rad/s^2].
        period: T [s].
        predicted: Receives (z_k, z_k'), shape (2 (3 + n),).
        predicted_pose: Receives the object's pose, shape (3,).
    """
    state, n = np.empty(6), robot.size // 2
    estimate_object(chain, p_LE, motion_room(chain), robot, pose, state)
    predicted[:] = robot
    for row in accelerations:
        state[:3] += period * (state[3:] + 0.5 * period * row[:3])
        state[3:] += period * row[:3]
        predicted[:n] += period * (predicted[n:] + 0.5 * period * row[3:])
        predicted[n:] += period * row[3:]
    predicted_pose[:] = state[:3]


def wanted_accelerations(
    chain: FloatArray,
    load: FloatArray,
    robot: FloatArray,
    pose: FloatArray,
    linear: FloatArray,
    axes: FloatArray,
    accelerations: FloatArray,
) -> None:
    """Write the accelerations of the object and of a robot's z_k that the law asks for, shape (6 + n,).

    Args:
        chain: From the robot's base to its end effector.
        load: The robot's load, as ``end_effector_command`` takes it, shape (7,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        pose: Pose of the object, shape (3,) [m, rad].
        linear: Desired acceleration of the object's origin, shape (2,) [m/s^2].
        axes: Desired accelerations of the object's angle and of the joints, shape (1 + n,).
        accelerations: Receives those of the object (3), of the base (3) and of the joints (n).
    """
    state, command, motion = np.empty(6), np.empty(6), motion_room(chain)
    estimate_object(chain, load[:2], motion, robot, pose, state)
    end_effector_command(load, state, linear, axes, command)
    accelerations[:2], accelerations[2] = linear, axes[0]
    accelerations[3:6] = base_acceleration(chain, motion, robot, command, axes)
    accelerations[6:] = axes[1:]
