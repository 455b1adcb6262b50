"""Motion of a planar chain: poses, velocities and accelerations of its links, from the root outwards.

A chain is a table with one row for each link and a last row for a frame that is fixed on one of the links.
A row says how the link is attached to its parent, in the plane of the root's frame with all joints at zero;
the reference point of a link is its joint.
"""

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.load_sharing import rotated
from coop_drake.tree.pose import FloatArray

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
