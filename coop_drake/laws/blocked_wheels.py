"""Wheels that are blocked: the wrenches of the floor that stop a base and then hold it, whatever pulls at it.

A base with blocked wheels has the acceleration -v / T_b, v being its planar velocity and yaw rate: it comes
to rest as exp(-t / T_b), and rests from then on. Nothing pulls harder than the floor holds. The wrenches
lambda that do this follow from the equations of motion of the whole team: the accelerations of all blocked
bases are a + A lambda, a without these wrenches, so that A lambda = -v / T_b - a.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.chain_motion import (
    ALPHA,
    AX,
    AY,
    COS,
    PX,
    PY,
    RATE,
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
)
from coop_drake.laws.load_sharing import rotated
from coop_drake.laws.team_dynamics import TeamWork, team_accelerations
from coop_drake.tree.pose import FloatArray, IntArray

BRAKING_TIME = 0.05
"""T_b [s]: a base at 0.5 m/s is braked by 10 m/s^2 at first, about what rubber on a floor gives."""

SINGULAR = 1e-9
"""Share of its first value below which a pivot is rounding [-]: several blocked bases may leave the team no
motion at all, and the floor's wrenches are then not unique; those without such a pivot are zero."""


class BlockedRoom(NamedTuple):
    """Room for what ``hold_blocked`` computes on the way, with m = 3 N.

    Attributes:
        joints: Accelerations of the joints, by the links that they lead to, shape (1 + n,).
        rates: Velocities and yaw rates of all bases, shape (m,) [m/s, rad/s].
        free: Their accelerations without the floor's wrenches, shape (m,) [m/s^2, rad/s^2].
        pushed: The same with one unit of one wrench, shape (m,).
        matrix: A, shape (m, m).
        wanted: What A lambda shall be, then lambda, shape (m,).
        active: 1 for entries of blocked bases, else 0, shape (m,).
    """

    joints: FloatArray
    rates: FloatArray
    free: FloatArray
    pushed: FloatArray
    matrix: FloatArray
    wanted: FloatArray
    active: FloatArray


@compiled
def blocked_room(links: int, robots: int) -> BlockedRoom:
    """Return room for a tree of so many links and robots."""
    m = 3 * robots
    return BlockedRoom(
        np.zeros(links), np.empty(m), np.empty(m), np.empty(m), np.empty((m, m)), np.empty(m), np.empty(m)
    )


@compiled
def hold_blocked(
    tree: FloatArray, bases: IntArray, places: FloatArray, blocked: FloatArray, efforts: FloatArray,
    gravity: float, state: FloatArray, work: TeamWork, room: BlockedRoom, accelerations: FloatArray,
    wrenches: FloatArray,
) -> None:  # fmt: skip
    """Add the floor's wrenches on all blocked bases to the others, and write the team's accelerations.

    Args:
        tree: As ``team_accelerations`` takes it; so are the next two arguments, of which the first N rows
            belong to the bases.
        bases: Rows of the links on which wrenches act.
        places: Where they act.
        blocked: 1 for every base with blocked wheels, else 0, shape (N,).
        efforts: This and the next three arguments are those of ``team_accelerations``, too.
        gravity: Acceleration along x of W.
        state: State of the team.
        work: What ``team_work`` returns.
        room: What ``blocked_room`` returns; it is overwritten.
        accelerations: Receives those of the team, shape (3 + n,).
        wrenches: Wrenches on all bases, and where there is a further row, on the object; receives the sum.
    """
    m, matrix, wanted, active = room.wanted.size, room.matrix, room.wanted, room.active
    team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
    _base_motion(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.free)
    for i in range(m):
        active[i] = blocked[i // 3]
        wanted[i] = -room.rates[i] / BRAKING_TIME - room.free[i]
    for j in range(m):
        if active[j] == 0.0:
            continue
        k, axis = j // 3, j % 3
        before = wrenches[k, axis]
        wrenches[k, axis] = before + 1.0
        team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
        wrenches[k, axis] = before
        _base_motion(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.pushed)
        for i in range(m):
            matrix[i, j] = room.pushed[i] - room.free[i]
    _solve(matrix, wanted, active)
    for j in range(m):
        wrenches[j // 3, j % 3] += wanted[j]
    team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)


@compiled
def _base_motion(
    tree: FloatArray, bases: IntArray, places: FloatArray, state: FloatArray, work: TeamWork,
    accelerations: FloatArray, joints: FloatArray, rates: FloatArray, second: FloatArray,
) -> None:  # fmt: skip
    """Write velocities and accelerations of all bases, each (x, y, yaw) in W.

    Args:
        tree: This and the next two arguments are those of ``hold_blocked``.
        bases: Rows of the links.
        places: Where wrenches act.
        state: State of the team.
        work: Its ``motion`` holds the motion of all links at this state, without accelerations.
        accelerations: Those of the team, each at the place of its rate, shape (3 + n,).
        joints: Room for those of the joints by links, shape (1 + n,).
        rates: Receives the velocities, shape (3 N,).
        second: Receives the accelerations, shape (3 N,).
    """
    motion, size, root = work.motion, tree.shape[0] + 2, int(tree[0, RATE])
    for i in range(1, tree.shape[0]):
        joints[i] = accelerations[int(tree[i, RATE]) - size]
    accelerate_chain(tree, state, joints, motion)
    last = tree.shape[0] - 1
    if last > 0:  # of a robot's chain the last row is fixed, so that its joint was left out
        motion[last, AX] += motion[last, UX] * joints[last]
        motion[last, AY] += motion[last, UY] * joints[last]
        motion[last, ALPHA] += tree[last, TURN] * joints[last]
    ax, ay, alpha = accelerations[root - size], accelerations[root - size + 1], accelerations[root - size + 2]
    for k in range(rates.size // 3):
        link, row = motion[bases[k]], tree[bases[k]]
        rx, ry = rotated(link[COS], link[SIN], places[k, 0] - row[X], places[k, 1] - row[Y])
        w = link[W]
        rates[3 * k] = state[root] + link[VX] - w * ry
        rates[3 * k + 1] = state[root + 1] + link[VY] + w * rx
        rates[3 * k + 2] = w
        second[3 * k] = ax + link[AX] - link[ALPHA] * ry - w * w * rx - alpha * (link[PY] + ry)
        second[3 * k + 1] = ay + link[AY] + link[ALPHA] * rx - w * w * ry + alpha * (link[PX] + rx)
        second[3 * k + 2] = alpha + link[ALPHA]


@compiled
def _solve(matrix: FloatArray, vector: FloatArray, active: FloatArray) -> None:
    """Replace b by a solution of A x = b in the active entries, x being zero elsewhere.

    A is symmetric and positive semidefinite. Gauss-Jordan elimination takes the largest pivots first, as
    shares of their first values, and ends where only rounding is left.
    """
    m = vector.size
    first = np.empty(m)
    for i in range(m):
        first[i] = matrix[i, i]
    for _ in range(m):
        pivot, best = -1, SINGULAR
        for i in range(m):
            if active[i] == 1.0 and matrix[i, i] > best * first[i]:
                pivot, best = i, matrix[i, i] / first[i]
        if pivot < 0:
            break
        active[pivot] = 2.0
        for i in range(m):
            if i != pivot and active[i] > 0.0:
                factor = matrix[i, pivot] / matrix[pivot, pivot]
                for j in range(m):
                    if active[j] > 0.0:
                        matrix[i, j] -= factor * matrix[pivot, j]
                vector[i] -= factor * vector[pivot]
    for i in range(m):
        vector[i] = vector[i] / matrix[i, i] if active[i] == 2.0 else 0.0
