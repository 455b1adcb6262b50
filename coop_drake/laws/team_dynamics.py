"""Equations of motion of a whole team in the plane: one tree whose root is the object.

The tree is a chain of ``laws/chain_motion.py`` in which every row is a link. Its coordinates are those of
the object, (x, y, theta), and of all joints. The mass matrix is made of composite inertias about the origin
of the object, the other forces by recursive Newton-Euler. This is the plant of a simulation; no robot
computes it.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.chain_motion import (
    AX,
    AY,
    COM_X,
    COM_Y,
    COS,
    DAMPING,
    INERTIA,
    MASS,
    PARENT,
    PX,
    PY,
    RATE,
    ROTOR,
    SIN,
    TURN,
    UX,
    UY,
    W,
    X,
    Y,
    accelerate_chain,
    move_chain,
)
from coop_drake.laws.load_sharing import rotated
from coop_drake.tree.pose import FloatArray, IntArray


class TeamWork(NamedTuple):
    """Room for what ``team_accelerations`` computes on the way, given so that it need not be made each time.

    Attributes:
        inertias: Mass, first moments and inertia of every link and what it carries, shape (1 + n, 4).
        forces: What these need while no coordinate accelerates, shape (1 + n, 3).
        matrix: The mass matrix, shape (3 + n, 3 + n).
        wanted: Forces without an acceleration, then accelerations, shape (3 + n,).
        still: Accelerations of joints that are zero, shape (1 + n,).
    """

    inertias: FloatArray
    forces: FloatArray
    matrix: FloatArray
    wanted: FloatArray
    still: FloatArray


@compiled
def team_work(links: int) -> TeamWork:
    """Return room for a tree of so many links, the object included."""
    size = links + 2
    return TeamWork(
        np.empty((links, 4)), np.empty((links, 3)), np.empty((size, size)), np.empty(size), np.zeros(links)
    )


@compiled
def team_accelerations(
    tree: FloatArray,
    pushed: IntArray,
    places: FloatArray,
    wrenches: FloatArray,
    efforts: FloatArray,
    gravity: float,
    state: FloatArray,
    work: TeamWork,
    accelerations: FloatArray,
) -> None:
    """Write the accelerations of the object and of all joints under given forces.

    Args:
        tree: The object in row 0, then a row for each link that a joint leads to, shape (1 + n, ``COLUMNS``).
        pushed: Rows of the links on which wrenches act, shape (m,).
        places: The points where they act, in the plane of the object's frame with all joints at zero, shape
            (m, 2) [m].
        wrenches: Forces in W and torques, shape (m, 3) [N, N m].
        efforts: Effort of every joint at the place of its rate, shape (3 + n,); the object's three are not
            read [N m or N].
        gravity: Acceleration along x of W of all masses [m/s^2].
        state: State of the team: 3 + n positions, then their rates in the same order.
        work: What ``team_work`` returns; it is overwritten.
        accelerations: Receives x'', y'', theta'' and those of the joints, each at the place of its rate,
            shape (3 + n,) [m/s^2 or rad/s^2].
    """
    size, wanted, inertias, forces, matrix = (
        tree.shape[0] + 2,
        work.wanted,
        work.inertias,
        work.forces,
        work.matrix,
    )
    motion = move_chain(tree, state)
    accelerate_chain(tree, state, work.still, motion)
    matrix[:] = 0.0
    for i in range(tree.shape[0]):
        _write_inertia(tree[i], motion[i], gravity, inertias[i], forces[i])
    for k in range(pushed.size):
        link = motion[pushed[k]]
        row = tree[pushed[k]]
        rx, ry = rotated(link[COS], link[SIN], places[k, 0] - row[X], places[k, 1] - row[Y])
        rx, ry = link[PX] + rx, link[PY] + ry
        forces[pushed[k], 0] -= wrenches[k, 0]
        forces[pushed[k], 1] -= wrenches[k, 1]
        forces[pushed[k], 2] -= wrenches[k, 2] + rx * wrenches[k, 1] - ry * wrenches[k, 0]
    for i in range(tree.shape[0] - 1, 0, -1):
        p = int(tree[i, PARENT])
        inertias[p] += inertias[i]
        forces[p] += forces[i]
        sx, sy, w = _direction(tree[i], motion[i])
        at = int(tree[i, RATE])
        along = sx * forces[i, 0] + sy * forces[i, 1] + w * forces[i, 2]
        wanted[2 + i] = efforts[at - size] - tree[i, DAMPING] * state[at] - along
        _write_row(tree, motion, inertias[i], i, matrix)
    m, mx, my, turning = inertias[0]
    matrix[0, 0], matrix[1, 1], matrix[2, 0], matrix[2, 1], matrix[2, 2] = m, m, -my, mx, turning
    for i in range(3):
        wanted[i] = -forces[0, i]
    solve_symmetric(matrix, wanted)
    for i in range(3):
        accelerations[int(tree[0, RATE]) - size + i] = wanted[i]
    for i in range(1, tree.shape[0]):
        accelerations[int(tree[i, RATE]) - size] = wanted[2 + i]


@compiled
def _write_inertia(
    row: FloatArray, motion: FloatArray, gravity: float, inertia: FloatArray, force: FloatArray
) -> None:
    """Write mass, first moments and inertia of a link about the object's origin, and what it needs anyway.

    That is the force and the torque about the origin while no coordinate accelerates.
    """
    ex, ey = rotated(motion[COS], motion[SIN], row[COM_X] - row[X], row[COM_Y] - row[Y])
    cx, cy, mass, w = motion[PX] + ex, motion[PY] + ey, row[MASS], motion[W]
    inertia[0], inertia[1], inertia[2] = mass, mass * cx, mass * cy
    inertia[3] = row[INERTIA] + mass * (cx * cx + cy * cy)
    fx, fy = mass * (motion[AX] - w * w * ex - gravity), mass * (motion[AY] - w * w * ey)
    force[0], force[1], force[2] = fx, fy, cx * fy - cy * fx


@compiled
def _direction(row: FloatArray, motion: FloatArray) -> tuple[float, float, float]:
    """Return what a unit rate of a joint adds to its link's velocity at the object's origin, and to w."""
    turn = row[TURN]
    return motion[UX] + turn * motion[PY], motion[UY] - turn * motion[PX], turn


@compiled
def _write_row(tree: FloatArray, motion: FloatArray, inertia: FloatArray, i: int, matrix: FloatArray) -> None:
    """Write the row of the mass matrix of the joint that leads to link i, left of its diagonal and on it."""
    sx, sy, w = _direction(tree[i], motion[i])
    m, mx, my, turning = inertia[0], inertia[1], inertia[2], inertia[3]
    fx, fy, torque = m * sx - my * w, m * sy + mx * w, turning * w + mx * sy - my * sx
    matrix[2 + i, 0], matrix[2 + i, 1], matrix[2 + i, 2] = fx, fy, torque
    matrix[2 + i, 2 + i] = sx * fx + sy * fy + w * torque + tree[i, ROTOR]
    j = int(tree[i, PARENT])
    while j > 0:
        sx, sy, w = _direction(tree[j], motion[j])
        matrix[2 + i, 2 + j] = sx * fx + sy * fy + w * torque
        j = int(tree[j, PARENT])


@compiled
def solve_symmetric(matrix: FloatArray, vector: FloatArray) -> None:
    """Replace a vector b by the solution x of A x = b, by Cholesky's factors of A.

    Args:
        matrix: A, positive definite, of which the part above the diagonal is not read; overwritten, (n, n).
        vector: b, shape (n,); receives x.
    """
    n = vector.size
    for i in range(n):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = sqrt(rest) if i == j else rest / matrix[j, j]
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
