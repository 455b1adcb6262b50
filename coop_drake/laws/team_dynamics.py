"""Equations of motion of a whole team in the plane: one tree whose root is the object.

The tree is a chain of ``laws/chain_motion.py`` in which every row is a link. Its coordinates are those of
the object, (x, y, theta), and of all joints. The mass matrix is made of composite inertias about the origin
of the object, the other forces by recursive Newton-Euler. This is the plant of a simulation; no robot
computes it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.chain_motion import (
    AX,
    AY,
    COM_X,
    COM_Y,
    COS,
    DAMPING,
    INERTIA,
    MASS,
    MOTION_COLUMNS,
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
    write_motion,
)
from coop_drake.laws.load_sharing import rotated
from coop_drake.tree.pose import FloatArray, IntArray


class TeamWork(NamedTuple):
    """Room for what ``team_accelerations`` computes on the way, given so that it need not be made each time.

    Attributes:
        parents: For each of the 3 + n coordinates the one that moves it next before, -1 for the first. Rows
            and columns of the mass matrix that have no such chain between them are zero, shape (3 + n,).
        motion: Motion of every link, shape (1 + n, ``MOTION_COLUMNS``).
        inertias: Mass, first moments and inertia of every link and what it carries, shape (1 + n, 4).
        forces: What these need while no coordinate accelerates, shape (1 + n, 3).
        matrix: The mass matrix, shape (3 + n, 3 + n).
        wanted: Forces without an acceleration, then accelerations, shape (3 + n,).
        still: Accelerations of joints that are zero, shape (1 + n,).
    """

    parents: IntArray
    motion: FloatArray
    inertias: FloatArray
    forces: FloatArray
    matrix: FloatArray
    wanted: FloatArray
    still: FloatArray


def team_work(tree: FloatArray) -> TeamWork:
    """Return room for a tree of the form that ``team_accelerations`` takes."""
    links = tree.shape[0]
    size = links + 2
    parents = np.arange(-1, size - 1)
    for i in range(1, links):
        parents[2 + i] = 2 + int(tree[i, PARENT])
    motion, inertias, forces = np.empty((links, MOTION_COLUMNS)), np.empty((links, 4)), np.empty((links, 3))
    return TeamWork(
        parents, motion, inertias, forces, np.empty((size, size)), np.empty(size), np.zeros(links)
    )


@compiled(borrows=True)
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
    size, wanted, motion, matrix = tree.shape[0] + 2, work.wanted, work.motion, work.matrix
    inertias, forces = work.inertias, work.forces
    write_motion(tree, state, motion)
    accelerate_chain(tree, state, work.still, motion)
    for i in range(tree.shape[0]):
        # Mass, first moments and inertia about the object's origin, and the force and torque there that are
        # needed while no coordinate accelerates.
        row, link = tree[i], motion[i]
        ex, ey = rotated(link[COS], link[SIN], row[COM_X] - row[X], row[COM_Y] - row[Y])
        cx, cy, mass, w = link[PX] + ex, link[PY] + ey, row[MASS], link[W]
        inertias[i, 0], inertias[i, 1], inertias[i, 2] = mass, mass * cx, mass * cy
        inertias[i, 3] = row[INERTIA] + mass * (cx * cx + cy * cy)
        fx, fy = mass * (link[AX] - w * w * ex - gravity), mass * (link[AY] - w * w * ey)
        forces[i, 0], forces[i, 1], forces[i, 2] = fx, fy, cx * fy - cy * fx
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
        for j in range(4):
            inertias[p, j] += inertias[i, j]
        for j in range(3):
            forces[p, j] += forces[i, j]
        sx, sy, w = _direction(tree[i], motion[i])
        at = int(tree[i, RATE])
        along = sx * forces[i, 0] + sy * forces[i, 1] + w * forces[i, 2]
        wanted[2 + i] = efforts[at - size] - tree[i, DAMPING] * state[at] - along
        _write_row(tree, motion, inertias[i], i, matrix)
    m, mx, my, turning = inertias[0, 0], inertias[0, 1], inertias[0, 2], inertias[0, 3]
    matrix[0, 0], matrix[1, 0], matrix[1, 1] = m, 0.0, m
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = -my, mx, turning
    for i in range(3):
        wanted[i] = -forces[0, i]
    solve_tree(work.parents, matrix, wanted)
    for i in range(3):
        accelerations[int(tree[0, RATE]) - size + i] = wanted[i]
    for i in range(1, tree.shape[0]):
        accelerations[int(tree[i, RATE]) - size] = wanted[2 + i]


@compiled(borrows=True)
def _direction(row: FloatArray, motion: FloatArray) -> tuple[float, float, float]:
    """Return what a unit rate of a joint adds to its link's velocity at the object's origin, and to w."""
    turn = row[TURN]
    return motion[UX] + turn * motion[PY], motion[UY] - turn * motion[PX], turn


@compiled(borrows=True)
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


@compiled(borrows=True)
def solve_tree(parents: IntArray, matrix: FloatArray, vector: FloatArray) -> None:
    """Replace a vector b by the solution x of A x = b, A being the mass matrix of a tree.

    A = L^T D L with the unit lower triangular L and the diagonal D. L is zero where A is, so that only the
    chain of coordinates before each one counts (Featherstone, 2008, "Rigid Body Dynamics Algorithms", 6.4).

    Args:
        parents: See ``TeamWork``, shape (n,).
        matrix: A, positive definite; only entries in a row of its coordinate's chain are read, and
            overwritten, shape (n, n).
        vector: b, shape (n,); receives x.
    """
    for k in range(vector.size - 1, -1, -1):
        inverse = 1.0 / matrix[k, k]
        i = parents[k]
        while i >= 0:
            factor, j = matrix[k, i] * inverse, i
            while j >= 0:
                matrix[i, j] -= factor * matrix[k, j]
                j = parents[j]
            matrix[k, i] = factor
            vector[i] -= factor * vector[k]
            i = parents[i]
        vector[k] *= inverse
    for k in range(vector.size):
        i = parents[k]
        while i >= 0:
            vector[k] -= matrix[k, i] * vector[i]
            i = parents[i]
