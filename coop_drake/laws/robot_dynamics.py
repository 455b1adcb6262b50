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
    FX,
    FY,
    INERTIA,
    MASS,
    PARENT,
    POSITION,
    PX,
    PY,
    RATE,
    ROTOR,
    SIN,
    TORQUE,
    TURN,
    UX,
    UY,
    VX,
    VY,
    W,
    X,
    Y,
    accelerate_chain,
    write_motion,
)
from coop_drake.laws.load_sharing import object_twist, rotated
from coop_drake.tree.pose import FloatArray, IntArray


@compiled(borrows=True)
def estimate_object(
    chain: FloatArray, p_LE: FloatArray, motion: FloatArray, robot: FloatArray, pose: FloatArray,
    object_state: FloatArray,
) -> None:  # fmt: skip
    """Write the object's pose and its twist as a robot knows it from its own motion J z', (27) and (29).

    Args:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        motion: Room for the chain's motion, see ``motion_room``.
        robot: (z_k, z_k'), shape (2 (3 + n),).
        pose: Pose of the object, shape (3,) [m, rad].
        object_state: Receives pose, velocity of L's origin and angular rate, shape (6,).
    """
    write_motion(chain, robot, motion)
    first, last = int(chain[0, RATE]), chain.shape[0] - 1
    vx, vy, w = robot[first] + motion[last, VX], robot[first + 1] + motion[last, VY], motion[last, W]
    rx, ry = rotated(np.cos(pose[2]), np.sin(pose[2]), p_LE[0], p_LE[1])
    object_state[0], object_state[1], object_state[2] = pose[0], pose[1], pose[2]
    object_state[3], object_state[4], object_state[5] = object_twist(rx, ry, vx, vy, w)


@compiled(borrows=True)
def read_robot(
    chain: FloatArray, yaw: float, joints: IntArray, motion: FloatArray, state: FloatArray, robot: FloatArray
) -> None:
    """Write z_k and z_k' of a robot whose base is the frame of a chain that begins at the object.

    Args:
        chain: From the object through the robot's joints to its base.
        yaw: Angle of the base in the object where all joints are at zero [rad].
        joints: Where the robot's joints stand in the state, then where their rates do, shape (2, n).
        motion: Room for the chain's motion, see ``motion_room``.
        state: State of the team.
        robot: Receives (x, y, yaw, q, and their rates), yaw in (-pi, pi], shape (2 (3 + n),).
    """
    write_motion(chain, state, motion)
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


@compiled(borrows=True)
def base_acceleration(
    chain: FloatArray, motion: FloatArray, robot: FloatArray, command: FloatArray, axes: FloatArray
) -> tuple[float, float, float]:
    """Return the acceleration of the base, J_b^-1 (x''_E - J' z' - J_q q''), (25)-(32).

    It gives the end effector the acceleration asked for, while the joints have theirs.

    Args:
        chain: From the robot's base to its end effector.
        motion: Receives the chain's motion, as if the base had no acceleration, see ``motion_room``.
        robot: (z_k, z_k'), shape (2 (3 + n),).
        command: x''_E first, shape (3,) or more [m/s^2, rad/s^2].
        axes: Accelerations of the object's angle, not used here, and of the joints, shape (1 + n,).

    Returns:
        Acceleration of Bk in W and angular acceleration [m/s^2, rad/s^2].
    """
    write_motion(chain, robot, motion)
    accelerate_chain(chain, robot, axes, motion)
    frame = motion[chain.shape[0] - 1]
    alpha = command[2] - frame[ALPHA]
    return (
        command[0] - frame[AX] + alpha * frame[PY],
        command[1] - frame[AY] - alpha * frame[PX],
        alpha,
    )


@compiled(borrows=True)
def robot_effort(
    chain: FloatArray, motion: FloatArray, robot: FloatArray, command: FloatArray, axes: FloatArray,
    effort: FloatArray,
) -> None:  # fmt: skip
    """Write the actuator forces M z'' + C z' + G + J^T tau_e of (22) and (33), errata E23, E25 and E33.

    z'' gives the joints the accelerations asked for; the base takes ``base_acceleration``. Gravity has no
    component in the plane.

    Args:
        chain: From the robot's base to its end effector, rows in the order of its joints.
        motion: Room for the chain's motion, see ``motion_room``.
        robot: (z_k, z_k'), shape (2 (3 + n),).
        command: x''_E, then tau_e on the object, in W, shape (6,) [m/s^2, rad/s^2, N, N m].
        axes: Accelerations of the object's angle, not used here, and of the joints, shape (1 + n,).
        effort: Receives the base wrench at Bk in W and the joint torques, shape (3 + n,) [N, N m].
    """
    last = chain.shape[0] - 1
    ax, ay, alpha = base_acceleration(chain, motion, robot, command, axes)
    for i in range(last):
        motion[i, FX], motion[i, FY], motion[i, TORQUE] = 0.0, 0.0, 0.0
    motion[last, FX], motion[last, FY], motion[last, TORQUE] = command[3], command[4], command[5]
    for i in range(last, -1, -1):
        link, row = motion[i], chain[i]
        w, mass = link[W], row[MASS]
        ex, ey = rotated(link[COS], link[SIN], row[COM_X] - row[X], row[COM_Y] - row[Y])
        turning = alpha + link[ALPHA]
        fx = mass * (link[AX] + ax - alpha * link[PY] - turning * ey - w * w * ex)
        fy = mass * (link[AY] + ay + alpha * link[PX] + turning * ex - w * w * ey)
        link[FX] += fx
        link[FY] += fy
        link[TORQUE] += row[INERTIA] * turning + ex * fy - ey * fx
        if i > 0:
            parent = motion[int(row[PARENT])]
            rx, ry = link[PX] - parent[PX], link[PY] - parent[PY]
            parent[FX] += link[FX]
            parent[FY] += link[FY]
            parent[TORQUE] += link[TORQUE] + rx * link[FY] - ry * link[FX]
    effort[0], effort[1], effort[2] = motion[0, FX], motion[0, FY], motion[0, TORQUE]
    for i in range(1, last):
        along = motion[i, UX] * motion[i, FX] + motion[i, UY] * motion[i, FY]
        of_joint = chain[i, DAMPING] * robot[int(chain[i, RATE])] + chain[i, ROTOR] * axes[i]
        effort[2 + i] = chain[i, TURN] * motion[i, TORQUE] + along + of_joint
