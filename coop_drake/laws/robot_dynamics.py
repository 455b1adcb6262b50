"""Motion and dynamics of one planar robot: J z' of (27) and the actuator forces of (22)-(34).

A robot is a chain of ``laws/chain_motion.py``. Poses are computed from the root outwards, forces from the
tips inwards (recursive Newton-Euler). The base is holonomic: it can take any acceleration, and no matrix
needs to be inverted.
"""

from math import atan2

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.chain_motion import (
    ALPHA,
    AX,
    AY,
    COM_X,
    COM_Y,
    COS,
    DAMPING,
    INERTIA,
    MASS,
    PARENT,
    POSITION,
    PX,
    PY,
    RATE,
    ROTOR,
    SIN,
    TURN,
    UX,
    UY,
    VX,
    VY,
    W,
    X,
    Y,
    accelerate_chain,
    move_chain,
)
from coop_drake.laws.load_sharing import object_twist, rotated
from coop_drake.tree.pose import FloatArray, IntArray


@compiled
def frame_twist(chain: FloatArray, state: FloatArray) -> tuple[float, float, float]:
    """Return J z' of the chain's frame: velocity of its origin and its angular rate in W [m/s, rad/s]."""
    motion = move_chain(chain, state)
    first, last = int(chain[0, RATE]), chain.shape[0] - 1
    return state[first] + motion[last, VX], state[first + 1] + motion[last, VY], motion[last, W]


@compiled(borrows=True)
def estimate_object(
    chain: FloatArray, p_LE: FloatArray, robot: FloatArray, pose: FloatArray, object_state: FloatArray
) -> None:
    """Write the object's pose and its twist as a robot knows it from its own motion, (27) and (29).

    Args:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        robot: (z_k, z_k'), shape (2 (3 + n),).
        pose: Pose of the object, shape (3,) [m, rad].
        object_state: Receives pose, velocity of L's origin and angular rate, shape (6,).
    """
    vx, vy, w = frame_twist(chain, robot)
    rx, ry = rotated(np.cos(pose[2]), np.sin(pose[2]), p_LE[0], p_LE[1])
    object_state[0], object_state[1], object_state[2] = pose[0], pose[1], pose[2]
    object_state[3], object_state[4], object_state[5] = object_twist(rx, ry, vx, vy, w)


@compiled
def read_robot(chain: FloatArray, yaw: float, joints: IntArray, state: FloatArray, robot: FloatArray) -> None:
    """Write z_k and z_k' of a robot whose base is the frame of a chain that begins at the object.

    Args:
        chain: From the object through the robot's joints to its base.
        yaw: Angle of the base in the object where all joints are at zero [rad].
        joints: Where the robot's joints stand in the state, then where their rates do, shape (2, n).
        state: State of the team.
        robot: Receives (x, y, yaw, q, and their rates), yaw in (-pi, pi], shape (2 (3 + n),).
    """
    motion = move_chain(chain, state)
    position, rate, last = int(chain[0, POSITION]), int(chain[0, RATE]), chain.shape[0] - 1
    n = joints.shape[1]
    c, s = rotated(motion[last, COS], motion[last, SIN], np.cos(yaw), np.sin(yaw))
    robot[0], robot[1], robot[2] = (
        state[position] + motion[last, PX],
        state[position + 1] + motion[last, PY],
        atan2(s, c),
    )
    robot[3 + n], robot[4 + n] = state[rate] + motion[last, VX], state[rate + 1] + motion[last, VY]
    robot[5 + n] = motion[last, W]
    for i in range(n):
        robot[3 + i], robot[6 + n + i] = state[joints[0, i]], state[joints[1, i]]


@compiled
def robot_effort(
    chain: FloatArray, robot: FloatArray, command: FloatArray, axes: FloatArray, effort: FloatArray
) -> None:
    """Write the actuator forces M z'' + C z' + G + J^T tau_e of (22) and (33), errata E23, E25 and E33.

    z'' gives the joints the accelerations asked for; the base takes J_b^-1 (x''_E - J' z' - J_q q''), so that
    the end effector has its acceleration too, (25)-(32). Gravity has no component in the plane.

    Args:
        chain: From the robot's base to its end effector, rows in the order of its joints.
        robot: (z_k, z_k'), shape (2 (3 + n),).
        command: x''_E, then tau_e on the object, in W, shape (6,) [m/s^2, rad/s^2, N, N m].
        axes: Accelerations of the object's angle, not used here, and of the joints, shape (1 + n,).
        effort: Receives the base wrench at Bk in W and the joint torques, shape (3 + n,) [N, N m].
    """
    last = chain.shape[0] - 1
    motion = move_chain(chain, robot)
    accelerate_chain(chain, robot, axes, motion)
    ax, ay, alpha = _of_root(motion[last], command)
    forces = np.zeros((last + 1, 3))  # on each link from its parent, about its reference point
    forces[last, 0], forces[last, 1], forces[last, 2] = command[3], command[4], command[5]
    for i in range(last, -1, -1):
        _add_inertia(chain[i], motion[i], ax, ay, alpha, forces[i])
        if i > 0:
            p = int(chain[i, PARENT])
            rx, ry = motion[i, PX] - motion[p, PX], motion[i, PY] - motion[p, PY]
            forces[p, 0] += forces[i, 0]
            forces[p, 1] += forces[i, 1]
            forces[p, 2] += forces[i, 2] + rx * forces[i, 1] - ry * forces[i, 0]
    effort[0], effort[1], effort[2] = forces[0, 0], forces[0, 1], forces[0, 2]
    for i in range(1, last):
        along = motion[i, UX] * forces[i, 0] + motion[i, UY] * forces[i, 1]
        of_joint = chain[i, DAMPING] * robot[int(chain[i, RATE])] + chain[i, ROTOR] * axes[i]
        effort[2 + i] = chain[i, TURN] * forces[i, 2] + along + of_joint


@compiled
def base_acceleration(
    chain: FloatArray, robot: FloatArray, command: FloatArray, axes: FloatArray
) -> tuple[float, float, float]:
    """Return the acceleration of the base with which ``robot_effort`` gives what is asked for, (25)-(32).

    Args:
        chain: From the robot's base to its end effector.
        robot: (z_k, z_k'), shape (2 (3 + n),).
        command: x''_E first, shape (3,) or more [m/s^2, rad/s^2].
        axes: Accelerations of the object's angle, not used here, and of the joints, shape (1 + n,).

    Returns:
        Acceleration of Bk in W and angular acceleration [m/s^2, rad/s^2].
    """
    motion = move_chain(chain, robot)
    accelerate_chain(chain, robot, axes, motion)
    return _of_root(motion[chain.shape[0] - 1], command)


@compiled(borrows=True)
def _of_root(frame: FloatArray, command: FloatArray) -> tuple[float, float, float]:
    """Return the root's acceleration that gives the last frame of a chain the acceleration commanded."""
    alpha = command[2] - frame[ALPHA]
    return (
        command[0] - frame[AX] + alpha * frame[PY],
        command[1] - frame[AY] - alpha * frame[PX],
        alpha,
    )


@compiled(borrows=True)
def _add_inertia(
    row: FloatArray, motion: FloatArray, ax: float, ay: float, alpha: float, force: FloatArray
) -> None:
    """Add the force that accelerates a link as it moves, the root's acceleration (ax, ay, alpha) included."""
    w, mass = motion[W], row[MASS]
    ex, ey = rotated(motion[COS], motion[SIN], row[COM_X] - row[X], row[COM_Y] - row[Y])
    turning = alpha + motion[ALPHA]
    fx = mass * (motion[AX] + ax - alpha * motion[PY] - turning * ey - w * w * ex)
    fy = mass * (motion[AY] + ay + alpha * motion[PX] + turning * ex - w * w * ey)
    force[0] += fx
    force[1] += fy
    force[2] += row[INERTIA] * turning + ex * fy - ey * fx
