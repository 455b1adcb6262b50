"""Motion and dynamics of planar chains, compiled: J z' and (22) of a robot without building any matrix.

A chain is a table with one row for each link and a last one for a frame that is fixed on one of them. Every
row says how the link hangs on its parent, in the plane of the root's frame, all joints at zero; a link's
reference point is the joint that it hangs by. Angles and positions add up from the root outwards, forces from
the tips inwards (recursive Newton-Euler); the base's share of the motion is rigid, so nothing is inverted.
"""

from math import atan2

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.laws.gains import FloatArray

#: Columns of a chain: index of the parent's row; reference point [m]; turn per unit of the joint (+1, -1, or
#: 0 where it slides or is fixed) and direction of sliding; where joint and rate stand in the state (of
#: the root and its rates: the first of three); mass [kg], centre of mass [m], inertia about it [kg m^2];
#: damping and inertia that the joint itself adds [N s/m or N m s; kg or kg m^2].
PARENT, X, Y, TURN, SLIDE_X, SLIDE_Y, POSITION, RATE, MASS, COM_X, COM_Y, INERTIA, DAMPING, ROTOR = range(14)
COLUMNS = 14

IntArray = NDArray[np.int64]

_COS, _SIN, _X, _Y, _VX, _VY, _W, _AX, _AY, _ALPHA = range(10)


@compiled
def move(chain: FloatArray, state: FloatArray, moved: FloatArray) -> None:
    """Motion of every row's reference point seen from the root's origin, in W, at the root's velocity.

    Args:
        chain: The chain, shape (links + 1, COLUMNS).
        state: Holds positions and rates of the root, (x, y, yaw), and of the joints.
        moved: Receives (cos, sin, x, y, x', y', w) of every row.
    """
    yaw = state[int(chain[0, POSITION]) + 2]
    moved[0, _COS], moved[0, _SIN] = np.cos(yaw), np.sin(yaw)
    moved[0, _X], moved[0, _Y], moved[0, _VX], moved[0, _VY] = 0.0, 0.0, 0.0, 0.0
    moved[0, _W] = state[int(chain[0, RATE]) + 2]
    for i in range(1, chain.shape[0]):
        p = int(chain[i, PARENT])
        q, rate = state[int(chain[i, POSITION])], state[int(chain[i, RATE])]
        c, s, w = moved[p, _COS], moved[p, _SIN], moved[p, _W]
        dx = chain[i, X] - chain[p, X] + chain[i, SLIDE_X] * q
        dy = chain[i, Y] - chain[p, Y] + chain[i, SLIDE_Y] * q
        rx, ry = c * dx - s * dy, s * dx + c * dy
        vx = c * chain[i, SLIDE_X] - s * chain[i, SLIDE_Y]
        vy = s * chain[i, SLIDE_X] + c * chain[i, SLIDE_Y]
        moved[i, _X], moved[i, _Y] = moved[p, _X] + rx, moved[p, _Y] + ry
        moved[i, _VX] = moved[p, _VX] - w * ry + vx * rate
        moved[i, _VY] = moved[p, _VY] + w * rx + vy * rate
        turn = chain[i, TURN]
        if turn == 0.0:
            moved[i, _COS], moved[i, _SIN], moved[i, _W] = c, s, w
        else:
            ct, st = np.cos(turn * q), np.sin(turn * q)
            moved[i, _COS], moved[i, _SIN], moved[i, _W] = c * ct - s * st, s * ct + c * st, w + turn * rate


@compiled
def _accelerate(chain: FloatArray, state: FloatArray, joints: FloatArray, moved: FloatArray) -> None:
    """Accelerations of every row, as if the root had none: moved[:, 7:] becomes (x'', y'', w')."""
    moved[0, _AX], moved[0, _AY], moved[0, _ALPHA] = 0.0, 0.0, 0.0
    links = chain.shape[0] - 1
    for i in range(1, chain.shape[0]):
        p = int(chain[i, PARENT])
        rate, acceleration = state[int(chain[i, RATE])], joints[i - 1] if i < links else 0.0
        c, s, w, alpha = moved[p, _COS], moved[p, _SIN], moved[p, _W], moved[p, _ALPHA]
        rx, ry = moved[i, _X] - moved[p, _X], moved[i, _Y] - moved[p, _Y]
        ux = c * chain[i, SLIDE_X] - s * chain[i, SLIDE_Y]
        uy = s * chain[i, SLIDE_X] + c * chain[i, SLIDE_Y]
        coriolis = 2.0 * w * rate
        moved[i, _AX] = moved[p, _AX] - alpha * ry - w * w * rx - coriolis * uy + ux * acceleration
        moved[i, _AY] = moved[p, _AY] + alpha * rx - w * w * ry + coriolis * ux + uy * acceleration
        moved[i, _ALPHA] = alpha + chain[i, TURN] * acceleration


@compiled
def frame_twist(chain: FloatArray, state: FloatArray) -> tuple[float, float, float]:
    """J z' of the chain's frame: velocity of its origin and its angular rate in W."""
    moved = np.empty((chain.shape[0], 10))
    move(chain, state, moved)
    first, last = int(chain[0, RATE]), chain.shape[0] - 1
    return state[first] + moved[last, _VX], state[first + 1] + moved[last, _VY], moved[last, _W]


@compiled
def object_state(
    chain: FloatArray, p_LE: FloatArray, robot: FloatArray, pose: FloatArray, state: FloatArray
) -> None:
    """Write the object's pose and its twist A^-1 J z' as a robot knows it from its own motion, (27).

    Args:
        chain: From the robot's base to its hand.
        p_LE: The grasp in L, shape (2,) [m].
        robot: (z_k, z_k'), shape (2 (3 + n),).
        pose: Of the object, shape (3,) [m, rad].
        state: Receives pose, velocity of L's origin and angular rate, shape (6,).
    """
    vx, vy, w = frame_twist(chain, robot)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    rx, ry = c * p_LE[0] - s * p_LE[1], s * p_LE[0] + c * p_LE[1]
    state[0], state[1], state[2] = pose[0], pose[1], pose[2]
    state[3], state[4], state[5] = vx + ry * w, vy - rx * w, w


@compiled
def read_robot(chain: FloatArray, yaw: float, joints: IntArray, state: FloatArray, robot: FloatArray) -> None:
    """Write z_k and z_k' of a robot whose base is the frame of a chain that begins at the object.

    Args:
        chain: From the object through the robot's joints to its base.
        yaw: Angle of the base in the object where all joints are at zero [rad].
        joints: Where the robot's joints stand in the state, then where their rates do, shape (2, n).
        state: Of the team.
        robot: Receives (x, y, yaw, q, and their rates), yaw in (-pi, pi], shape (2 (3 + n),).
    """
    moved = np.empty((chain.shape[0], 10))
    move(chain, state, moved)
    position, rate, last = int(chain[0, POSITION]), int(chain[0, RATE]), chain.shape[0] - 1
    n = joints.shape[1]
    c, s = np.cos(yaw), np.sin(yaw)
    robot[0], robot[1] = state[position] + moved[last, _X], state[position + 1] + moved[last, _Y]
    cb, sb = moved[last, _COS], moved[last, _SIN]
    robot[2] = atan2(sb * c + cb * s, cb * c - sb * s)
    robot[3 + n], robot[4 + n] = state[rate] + moved[last, _VX], state[rate + 1] + moved[last, _VY]
    robot[5 + n] = moved[last, _W]
    for i in range(n):
        robot[3 + i], robot[6 + n + i] = state[joints[0, i]], state[joints[1, i]]


@compiled
def read_team(
    pose: IntArray, first: IntArray, ways: FloatArray, yaws: FloatArray, first_joint: IntArray,
    joints: IntArray, state: FloatArray, measured: FloatArray,
) -> None:  # fmt: skip
    """Write the object's pose, then of every robot what ``read_robot`` writes.

    Args:
        pose: Where the object's pose stands in the state, shape (3,).
        first: Row of ``ways`` with which each robot's begin, and the number of rows, shape (N + 1,).
        ways: From the object to every robot's base.
        yaws: Angles of the bases in the object where all joints are at zero, shape (N,) [rad].
        first_joint: As ``first``, of ``joints``.
        joints: Where all joints stand in the state, then where their rates do, shape (2, n).
        state: Of the team.
        measured: Receives all, shape (3 + 6 N + 2 n,).
    """
    for i in range(3):
        measured[i] = state[pose[i]]
    at = 3
    for k in range(yaws.size):
        own = joints[:, first_joint[k] : first_joint[k + 1]]
        end = at + 2 * (3 + own.shape[1])
        read_robot(ways[first[k] : first[k + 1]], yaws[k], own, state, measured[at:end])
        at = end


@compiled
def chain_effort(
    chain: FloatArray, state: FloatArray, hand: FloatArray, joints: FloatArray, effort: FloatArray
) -> None:
    """Write M z'' + C z' + J^T tau_e of (22) where z'' gives the hand and the joints what they are asked for.

    The base takes J_b^-1 (x''_E - J' z' - J_q q''), as in ``robot_acceleration``.

    Args:
        chain: From the robot's base to its hand, rows in the order of its joints.
        state: (z_k, z_k'), shape (2 (3 + n),).
        hand: x''_E, then tau_e, in W, shape (6,) [m/s^2, rad/s^2, N, N m].
        joints: q'', shape (n,).
        effort: Receives the base wrench at Bk in W and the joint torques, shape (3 + n,) [N, N m].
    """
    last = chain.shape[0] - 1
    moved = np.empty((last + 1, 10))
    move(chain, state, moved)
    _accelerate(chain, state, joints, moved)
    alpha = hand[2] - moved[last, _ALPHA]
    ax = hand[0] - moved[last, _AX] + alpha * moved[last, _Y]
    ay = hand[1] - moved[last, _AY] - alpha * moved[last, _X]
    forces = np.zeros((last + 1, 3))  # on each link from its parent, about its reference point
    forces[last, 0], forces[last, 1], forces[last, 2] = hand[3], hand[4], hand[5]
    for i in range(last, -1, -1):
        _add_inertia(chain[i], moved[i], ax, ay, alpha, forces[i])
        if i > 0:
            p = int(chain[i, PARENT])
            rx, ry = moved[i, _X] - moved[p, _X], moved[i, _Y] - moved[p, _Y]
            forces[p, 0] += forces[i, 0]
            forces[p, 1] += forces[i, 1]
            forces[p, 2] += forces[i, 2] + rx * forces[i, 1] - ry * forces[i, 0]
    effort[0], effort[1], effort[2] = forces[0, 0], forces[0, 1], forces[0, 2]
    for i in range(1, last):
        p = int(chain[i, PARENT])
        c, s = moved[p, _COS], moved[p, _SIN]
        ux = c * chain[i, SLIDE_X] - s * chain[i, SLIDE_Y]
        uy = s * chain[i, SLIDE_X] + c * chain[i, SLIDE_Y]
        along = chain[i, TURN] * forces[i, 2] + ux * forces[i, 0] + uy * forces[i, 1]
        own = chain[i, DAMPING] * state[int(chain[i, RATE])] + chain[i, ROTOR] * joints[i - 1]
        effort[2 + i] = along + own


@compiled
def axes_effort(
    chain: FloatArray, state: FloatArray, hand: FloatArray, axes: FloatArray, effort: FloatArray
) -> None:
    """Write what ``chain_effort`` does from accelerations of the axes (theta, q_k), shape (1 + n,)."""
    chain_effort(chain, state, hand, axes[1:], effort)


@compiled
def _add_inertia(
    row: FloatArray, moved: FloatArray, ax: float, ay: float, alpha: float, force: FloatArray
) -> None:
    """Add what a link's own acceleration takes, the root's acceleration included."""
    w, c, s, mass = moved[_W], moved[_COS], moved[_SIN], row[MASS]
    dx, dy = row[COM_X] - row[X], row[COM_Y] - row[Y]
    ex, ey = c * dx - s * dy, s * dx + c * dy
    turning = alpha + moved[_ALPHA]
    fx = mass * (moved[_AX] + ax - alpha * moved[_Y] - turning * ey - w * w * ex)
    fy = mass * (moved[_AY] + ay + alpha * moved[_X] + turning * ex - w * w * ey)
    force[0] += fx
    force[1] += fy
    force[2] += row[INERTIA] * turning + ex * fy - ey * fx
