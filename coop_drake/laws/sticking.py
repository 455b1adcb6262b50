"""What sticks: wheels that are blocked, and joints with dry friction.

Each is a force that lets a rate come to rest, as far as it is strong enough. Blocked wheels hold their base
whatever pulls at it: planar velocity and yaw rate v have the acceleration -v / T_b. The friction of a joint
is at most f_c. It is that with which the joint has the acceleration -q' / T_q, if so little suffices, and f_c
against the motion otherwise. So a joint at rest stays there while no more than f_c pulls at it, and one that
moves is braked by f_c until it is so slow that f_c stops it within about T_q.

The forces lambda follow from the equations of motion of the whole team: the accelerations of all that may
stick are a + A lambda, a without these forces. With w = A lambda - (-v / T - a) and |lambda_i| <= f_i,

    w_i = 0,  or  lambda_i = f_i and w_i <= 0,  or  lambda_i = -f_i and w_i >= 0.

A is symmetric and positive semidefinite. The solution is found by taking one more force at its limit, or one
less, the first one that is wrong (Murty 1974, "Note on a Bard-type scheme for solving the complementarity
problem"). Joints that cannot move because the wheels of several bases are blocked have no friction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
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

STICKING_TIME = 0.01
"""T_q [s]: friction of 0.5 N m stops a link of 0.1 kg m^2 within it from 0.05 rad/s. Two steps of the
compiled loop are as long."""

SINGULAR = 1e-9
"""Share of its first value below which a pivot is rounding [-]: several blocked bases may leave the team no
motion at all, and the forces are then not unique; those without such a pivot are zero."""

ROUNDING = 1e-9
"""Share of its limit by which a friction may exceed it [-], and of the free accelerations by which it may be
taken for the one that sticks."""

ATTEMPTS = 200
"""Largest number of choices that are tried [-]; far fewer are needed for some joints."""


class StickingRoom(NamedTuple):
    """Room for what ``stick`` computes on the way, with m = 3 N + n: all bases, then all joints.

    Attributes:
        joints: Accelerations of the joints, by the links that they lead to, shape (1 + n,).
        rates: Velocities and yaw rates of all bases, rates of all joints, shape (m,).
        free: Their accelerations without the forces, shape (m,).
        pushed: The same with one unit of one force, shape (m,).
        matrix: A, shape (m, m).
        pivots: The same while it is eliminated, shape (m, m).
        wanted: What A lambda shall be, shape (m,).
        found: lambda, shape (m,) [N, N m].
        limits: f_i, infinite for blocked wheels and zero for what does not stick, shape (m,).
        chosen: 1 where f_i is the force, -1 where -f_i is, else 0, shape (m,).
        active: 1 for forces that are solved for, else 0, shape (m,).
        first: First values of the pivots, shape (m,).
    """

    joints: FloatArray
    rates: FloatArray
    free: FloatArray
    pushed: FloatArray
    matrix: FloatArray
    pivots: FloatArray
    wanted: FloatArray
    found: FloatArray
    limits: FloatArray
    chosen: FloatArray
    active: FloatArray
    first: FloatArray


def sticking_room(links: int, robots: int) -> StickingRoom:
    """Return room for a tree of so many links and robots."""
    m = 3 * robots + links - 1
    return StickingRoom(
        np.zeros(links), np.empty(m), np.empty(m), np.empty(m), np.zeros((m, m)), np.empty((m, m)),
        np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m),
    )  # fmt: skip


@compiled(borrows=True)
def stick(
    tree: FloatArray, bases: IntArray, places: FloatArray, blocked: FloatArray, friction: FloatArray,
    efforts: FloatArray, gravity: float, state: FloatArray, work: TeamWork, room: StickingRoom,
    accelerations: FloatArray, wrenches: FloatArray,
) -> None:  # fmt: skip
    """Add the floor's wrenches on all blocked bases and the friction of all joints, and write accelerations.

    Args:
        tree: As ``team_accelerations`` takes it; so are the next two arguments, of which the first N rows
            belong to the bases.
        bases: Rows of the links on which wrenches act.
        places: Where they act.
        blocked: 1 for every base with blocked wheels, else 0, shape (N,).
        friction: f_c of every joint [N m or N], and what it has besides for each unit of its rate [N m s or
            N s/m], shape (2,).
        efforts: This and the next three arguments are those of ``team_accelerations``, too; receives the
            efforts of the joints with their friction.
        gravity: Acceleration along x of W.
        state: State of the team.
        work: What ``team_work`` returns.
        room: What ``sticking_room`` returns; it is overwritten.
        accelerations: Receives those of the team, shape (3 + n,).
        wrenches: Wrenches on all bases, and where there is a further row, on the object; receives the sum.
    """
    m, size, first = room.wanted.size, tree.shape[0] + 2, 3 * blocked.size
    for i in range(1, tree.shape[0]):
        rate = int(tree[i, RATE])
        efforts[rate - size] -= friction[1] * state[rate]
    team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
    _motion_of(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.free)
    for i in range(m):
        room.limits[i] = friction[0] if i >= first else np.inf if blocked[i // 3] == 1.0 else 0.0
        room.wanted[i] = -room.rates[i] / (STICKING_TIME if i >= first else BRAKING_TIME) - room.free[i]
    for j in range(m):
        if room.limits[j] == 0.0:
            continue
        _add(j, 1.0, tree, wrenches, efforts, first)
        team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
        _add(j, -1.0, tree, wrenches, efforts, first)
        _motion_of(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.pushed)
        for i in range(m):
            room.matrix[i, j] = room.pushed[i] - room.free[i]
    _choose(room)
    for j in range(m):
        if room.limits[j] > 0.0:
            _add(j, room.found[j], tree, wrenches, efforts, first)
    team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)


@compiled(borrows=True)
def _add(
    j: int, force: float, tree: FloatArray, wrenches: FloatArray, efforts: FloatArray, first: int
) -> None:
    """Add a force of one kind; that of the first joint has the number ``first``."""
    if j < first:
        wrenches[j // 3, j % 3] += force
    else:
        efforts[int(tree[1 + j - first, RATE]) - tree.shape[0] - 2] += force


@compiled(borrows=True)
def _choose(room: StickingRoom) -> None:
    """Write the forces: which of them are at their limits, and what the others are."""
    m, wanted, found, chosen = room.wanted.size, room.wanted, room.found, room.chosen
    for i in range(m):
        chosen[i] = 0.0
    for _ in range(ATTEMPTS):
        for i in range(m):
            room.active[i] = 1.0 if chosen[i] == 0.0 and room.limits[i] > 0.0 else 0.0
            found[i] = wanted[i]
            for j in range(m):
                room.pivots[i, j] = room.matrix[i, j]
                if chosen[j] != 0.0:
                    found[i] -= room.matrix[i, j] * chosen[j] * room.limits[j]
        _solve(room.pivots, found, room.active, room.limits, room.first)
        wrong = False
        for i in range(m):
            if chosen[i] != 0.0:
                found[i] = chosen[i] * room.limits[i]
        for i in range(m):
            if room.limits[i] == 0.0:
                continue
            if chosen[i] == 0.0:
                if abs(found[i]) > (1.0 + ROUNDING) * room.limits[i]:
                    chosen[i], wrong = 1.0 if found[i] > 0.0 else -1.0, True
            else:
                left = -wanted[i]
                for j in range(m):
                    left += room.matrix[i, j] * found[j] if room.limits[j] > 0.0 else 0.0
                if left * chosen[i] > ROUNDING * (1.0 + abs(wanted[i])):
                    chosen[i], wrong = 0.0, True
            if wrong:
                break
        if not wrong:
            break
    for i in range(m):
        found[i] = min(max(found[i], -room.limits[i]), room.limits[i])


@compiled(borrows=True)
def _motion_of(
    tree: FloatArray, bases: IntArray, places: FloatArray, state: FloatArray, work: TeamWork,
    accelerations: FloatArray, joints: FloatArray, rates: FloatArray, second: FloatArray,
) -> None:  # fmt: skip
    """Write velocities and accelerations of all bases, each (x, y, yaw) in W, then those of all joints.

    Args:
        tree: This and the next two arguments are those of ``stick``.
        bases: Rows of the links.
        places: Where wrenches act.
        state: State of the team.
        work: Its ``motion`` holds the motion of all links at this state, without accelerations.
        accelerations: Those of the team, each at the place of its rate, shape (3 + n,).
        joints: Room for those of the joints by links, shape (1 + n,).
        rates: Receives the velocities, shape (m,).
        second: Receives the accelerations, shape (m,).
    """
    motion, size, root = work.motion, tree.shape[0] + 2, int(tree[0, RATE])
    robots = (rates.size + 1 - tree.shape[0]) // 3
    for i in range(1, tree.shape[0]):
        joints[i] = accelerations[int(tree[i, RATE]) - size]
        rates[3 * robots + i - 1], second[3 * robots + i - 1] = state[int(tree[i, RATE])], joints[i]
    accelerate_chain(tree, state, joints, motion)
    last = tree.shape[0] - 1
    if last > 0:  # of a robot's chain the last row is fixed, so that its joint was left out
        motion[last, AX] += motion[last, UX] * joints[last]
        motion[last, AY] += motion[last, UY] * joints[last]
        motion[last, ALPHA] += tree[last, TURN] * joints[last]
    ax, ay, alpha = accelerations[root - size], accelerations[root - size + 1], accelerations[root - size + 2]
    for k in range(robots):
        link, row = motion[bases[k]], tree[bases[k]]
        rx, ry = rotated(link[COS], link[SIN], places[k, 0] - row[X], places[k, 1] - row[Y])
        w = link[W]
        rates[3 * k] = state[root] + link[VX] - w * ry
        rates[3 * k + 1] = state[root + 1] + link[VY] + w * rx
        rates[3 * k + 2] = w
        second[3 * k] = ax + link[AX] - link[ALPHA] * ry - w * w * rx - alpha * (link[PY] + ry)
        second[3 * k + 1] = ay + link[AY] + link[ALPHA] * rx - w * w * ry + alpha * (link[PX] + rx)
        second[3 * k + 2] = alpha + link[ALPHA]


@compiled(borrows=True)
def _solve(
    matrix: FloatArray, vector: FloatArray, active: FloatArray, limits: FloatArray, first: FloatArray
) -> None:
    """Replace b by a solution of A x = b in the active entries, x being zero elsewhere.

    A is symmetric and positive semidefinite. Gauss-Jordan elimination takes the largest pivots first, as
    shares of their first values, for which ``first`` is room, and ends where only rounding is left. Forces
    without a limit come before the others.
    """
    m = vector.size
    for i in range(m):
        first[i] = matrix[i, i]
    limited = False
    for _ in range(m + 1):
        pivot, best = -1, SINGULAR
        for i in range(m):
            due = active[i] == 1.0 and (limited or limits[i] == np.inf)
            if due and matrix[i, i] > best * first[i]:
                pivot, best = i, matrix[i, i] / first[i]
        if pivot < 0:
            if limited:
                break
            limited = True
            continue
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
