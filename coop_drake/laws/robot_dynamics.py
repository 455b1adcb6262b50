"""One robot: the motion of its chain, its share of the load, and the efforts that it takes."""

from __future__ import annotations

from math import atan2, cos, sin

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray

# Shares of the wrench that moves the object, equations (21), (27)-(29) and (31).
#
# All vectors are in W, planar order (x, y, rotation). In the paper the object's origin L is its centre of
# mass; here it need not be.


@compiled
def rotated(c: float, s: float, x: float, y: float) -> tuple[float, float]:
    """Return the vector (x, y) turned by an angle whose cosine and sine are c and s."""
    return c * x - s * y, s * x + c * y


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


# Motion of a planar chain: poses, velocities and accelerations of its links, from the root outwards.
#
# A chain is a table with one row for each link and a last row for a frame that is fixed on one of the
# links. A row says how the link is attached to its parent, in the plane of the root's frame with all joints
# at zero; the reference point of a link is its joint.

PARENT, X, Y, TURN, SLIDE_X, SLIDE_Y, POSITION, RATE, MASS, COM_X, COM_Y, INERTIA, DAMPING, ROTOR = range(14)
COLUMNS = 14
"""Columns of a chain: index of the parent's row [-]; reference point [m]; rotation for each unit of the
joint's coordinate (+1 or -1, or 0 where it slides or is fixed) and direction of sliding [-]; where the
joint's coordinate and its rate stand in the state [-] (for the root, the first of three each); mass [kg],
centre of mass [m], inertia about it [kg m^2]; damping [N s/m or N m s] and inertia [kg or kg m^2] that the
joint itself adds."""

MOTION_COLUMNS = 15
COS, SIN, PX, PY, VX, VY, W, AX, AY, ALPHA, UX, UY, FX, FY, TORQUE = range(MOTION_COLUMNS)
"""Columns of the motion of a chain: cosine and sine of a row's angle [-], position of its reference point
relative to the root's origin [m], its velocity [m/s] and angular rate [rad/s], its acceleration [m/s^2] and
angular acceleration [rad/s^2], the direction in which its joint slides [-], and the force [N] and the torque
[N m] on it from its parent, about its reference point, all in W."""


def motion_room(chain: FloatArray) -> FloatArray:
    """Return room for the motion of a chain, which compiled functions take so that they need not make it."""
    return np.empty((chain.shape[0], MOTION_COLUMNS))


@compiled(borrows=True)
def write_motion(chain: FloatArray, state: FloatArray, motion: FloatArray) -> None:
    """Write the motion of every row's reference point relative to the root's origin, in W.

    Args:
        chain: The chain, shape (links + 1, ``COLUMNS``).
        state: Holds the positions and the rates of the root, (x, y, yaw), and of the joints.
        motion: Receives (cos, sin, x, y, x', y', w) of every row, and the direction in which its joint
            slides, in their columns, shape (links + 1, ``MOTION_COLUMNS``) or with more rows [m, m/s, rad/s].
    """
    yaw = state[int(chain[0, POSITION]) + 2]
    motion[0, COS], motion[0, SIN] = np.cos(yaw), np.sin(yaw)
    motion[0, PX], motion[0, PY], motion[0, VX], motion[0, VY] = 0.0, 0.0, 0.0, 0.0
    motion[0, W] = state[int(chain[0, RATE]) + 2]
    for i in range(1, chain.shape[0]):
        p = int(chain[i, PARENT])
        q, rate, turn = state[int(chain[i, POSITION])], state[int(chain[i, RATE])], chain[i, TURN]
        c, s, w = motion[p, COS], motion[p, SIN], motion[p, W]
        dx = chain[i, X] - chain[p, X] + chain[i, SLIDE_X] * q
        dy = chain[i, Y] - chain[p, Y] + chain[i, SLIDE_Y] * q
        rx, ry = rotated(c, s, dx, dy)
        ux, uy = rotated(c, s, chain[i, SLIDE_X], chain[i, SLIDE_Y])
        motion[i, UX], motion[i, UY] = ux, uy
        motion[i, PX], motion[i, PY] = motion[p, PX] + rx, motion[p, PY] + ry
        motion[i, VX] = motion[p, VX] - w * ry + ux * rate
        motion[i, VY] = motion[p, VY] + w * rx + uy * rate
        if turn == 0.0:
            motion[i, COS], motion[i, SIN], motion[i, W] = c, s, w
        else:
            motion[i, COS], motion[i, SIN] = rotated(c, s, np.cos(turn * q), np.sin(turn * q))
            motion[i, W] = w + turn * rate


@compiled(borrows=True)
def accelerate_chain(chain: FloatArray, robot: FloatArray, axes: FloatArray, motion: FloatArray) -> None:
    """Write (x'', y'', w') of every row as if the root had no acceleration."""
    motion[0, AX], motion[0, AY], motion[0, ALPHA] = 0.0, 0.0, 0.0
    links = chain.shape[0] - 1
    for i in range(1, chain.shape[0]):
        p = int(chain[i, PARENT])
        rate, acceleration = robot[int(chain[i, RATE])], axes[i] if i < links else 0.0
        w, alpha, ux, uy = motion[p, W], motion[p, ALPHA], motion[i, UX], motion[i, UY]
        rx, ry = motion[i, PX] - motion[p, PX], motion[i, PY] - motion[p, PY]
        coriolis = 2.0 * w * rate
        motion[i, AX] = motion[p, AX] - alpha * ry - w * w * rx - coriolis * uy + ux * acceleration
        motion[i, AY] = motion[p, AY] + alpha * rx - w * w * ry + coriolis * ux + uy * acceleration
        motion[i, ALPHA] = alpha + chain[i, TURN] * acceleration


# Motion and dynamics of one planar robot: J z' of (27) and the actuator forces of (22)-(34).
#
# A robot is a chain of ``laws/robot_dynamics.py``. Poses are computed from the root outwards, forces from the
# tips inwards (recursive Newton-Euler). The base is holonomic: it can take any acceleration, and no matrix
# needs to be inverted.


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
    object_state[3], object_state[4], object_state[5] = vx + ry * w, vy - rx * w, w


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
