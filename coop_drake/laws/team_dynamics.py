"""The team as one tree: its accelerations, and what friction and blocked wheels do to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.robot_dynamics import (
    ALPHA,
    AX,
    AY,
    COLUMNS,
    COM_X,
    COM_Y,
    COS,
    DAMPING,
    INERTIA,
    MASS,
    MOTION_COLUMNS,
    PARENT,
    POSITION,
    PX,
    PY,
    RATE,
    ROTOR,
    SIN,
    SLIDE_X,
    SLIDE_Y,
    TURN,
    UX,
    UY,
    VX,
    VY,
    W,
    X,
    Y,
    accelerate_chain,
    rotated,
    write_motion,
)
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import Bodies, ComponentTree, PlanarPose

# Equations of motion of a whole team in the plane: one tree whose root is the object.
#
# The tree is a chain of ``laws/robot_dynamics.py`` in which every row is a link. Its coordinates are those of
# the object, (x, y, theta), and of all joints. The mass matrix is made of composite inertias about the
# origin of the object, the other forces by recursive Newton-Euler. This is the plant of a simulation; no
# robot computes it.


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
        # What a unit rate of the joint adds to its link's velocity at the object's origin, and to w.
        link, w, at = motion[i], tree[i, TURN], int(tree[i, RATE])
        sx, sy = link[UX] + w * link[PY], link[UY] - w * link[PX]
        along = sx * forces[i, 0] + sy * forces[i, 1] + w * forces[i, 2]
        wanted[2 + i] = efforts[at - size] - tree[i, DAMPING] * state[at] - along
        # The row of the mass matrix of the joint that leads to link i, left of its diagonal and on it.
        m, mx, my, turning = inertias[i, 0], inertias[i, 1], inertias[i, 2], inertias[i, 3]
        fx, fy, torque = m * sx - my * w, m * sy + mx * w, turning * w + mx * sy - my * sx
        matrix[2 + i, 0], matrix[2 + i, 1], matrix[2 + i, 2] = fx, fy, torque
        matrix[2 + i, 2 + i] = sx * fx + sy * fy + w * torque + tree[i, ROTOR]
        while p > 0:
            link, w = motion[p], tree[p, TURN]
            sx, sy = link[UX] + w * link[PY], link[UY] - w * link[PX]
            matrix[2 + i, 2 + p] = sx * fx + sy * fy + w * torque
            p = int(tree[p, PARENT])
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


# A team as one chain whose root is the object, from its tree and the masses of its bodies.


def team_chain(tree: ComponentTree, bodies: Bodies, rotors: Sequence[float]) -> FloatArray:
    """Return the team as a chain of ``laws/robot_dynamics.py``; its state is (x, y, theta, q...) and rates.

    Args:
        tree: The team.
        bodies: All bodies.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
    """
    chain, size, frames = np.zeros((len(tree.components), COLUMNS)), 3 + len(tree.joints), frames_of(tree)
    chain[0, RATE] = size
    for row, component in zip(chain[1:], tree.components[1:], strict=True):
        joint, parent = component.joint, component.parent
        assert joint is not None
        assert parent is not None
        frame = frames[parent] @ joint.X_PJ
        row[[PARENT, X, Y]] = parent, frame.x, frame.y
        row[[POSITION, RATE]] = 3 + joint.index, size + 3 + joint.index
        row[ROTOR] = rotors[joint.index] if len(rotors) else 0.0
        if joint.kind == "revolute":
            row[TURN] = joint.sign
        else:
            row[[SLIDE_X, SLIDE_Y]] = PlanarPose(angle=frame.angle).apply(np.array(joint.axis))
    for body in bodies:
        _add_body(chain[int(body[0])], frames[int(body[0])].apply(np.array(body[2:4])), body[1], body[4])
    return chain


def frames_of(tree: ComponentTree) -> list[PlanarPose]:
    """Return the pose of every component's frame in that of the object, with all joints at zero."""
    frames = [PlanarPose()]
    for component in tree.components[1:]:
        assert component.joint is not None
        assert component.parent is not None
        frames.append(frames[component.parent] @ component.joint.X_PJ)
    return frames


def _add_body(row: FloatArray, centre: FloatArray, mass: float, inertia: float) -> None:
    """Add a body to a link: the centre of mass of both, and their inertia about it."""
    both = row[MASS] + mass
    away = centre - row[[COM_X, COM_Y]]
    row[INERTIA] += inertia + row[MASS] * mass / both * (away @ away)
    row[[COM_X, COM_Y]] += mass / both * away
    row[MASS] = both


# What sticks: wheels that are blocked, and joints with dry friction.
#
# Each is a force that lets a rate come to rest, as far as it is strong enough. Blocked wheels hold their
# base whatever pulls at it: planar velocity and yaw rate v have the acceleration -v / T_b. The friction of
# a joint is at most f_c. It is that with which the joint has the acceleration -q' / T_q, if so little
# suffices, and f_c against the motion otherwise. So a joint at rest stays there while no more than f_c
# pulls at it, and one that moves is braked by f_c until it is so slow that f_c stops it within about T_q.
#
# The forces lambda follow from the equations of motion of the whole team: the accelerations of all that may
# stick are a + A lambda, a without these forces. With w = A lambda - (-v / T - a) and |lambda_i| <= f_i,
#
# w_i = 0, or lambda_i = f_i and w_i <= 0, or lambda_i = -f_i and w_i >= 0.
#
# A is symmetric and positive semidefinite. The solution is found by taking one more force at its limit, or
# one less, the first one that is wrong (Murty 1974, "Note on a Bard-type scheme for solving the
# complementarity problem"). Joints that cannot move because the wheels of several bases are blocked have no
# friction.

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
    tree: FloatArray, bases: IntArray, places: FloatArray, blocked: FloatArray, instant: float,
    friction: FloatArray, efforts: FloatArray, gravity: float, state: FloatArray, work: TeamWork,
    room: StickingRoom, accelerations: FloatArray, wrenches: FloatArray,
) -> None:  # fmt: skip
    """Add the floor's wrenches on all blocked bases and the friction of all joints, and write accelerations.

    Args:
        tree: As ``team_accelerations`` takes it; so are the next two arguments, of which the first N rows
            belong to the bases.
        bases: Rows of the links on which wrenches act.
        places: Where they act.
        blocked: When the wheels of every base are blocked from and until, shape (2, N) [s].
        instant: Time at which it is decided whether they are [s].
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
    wanted, found, chosen = room.wanted, room.found, room.chosen
    m, size, first, sticks = wanted.size, tree.shape[0] + 2, 3 * blocked.shape[1], False
    for i in range(m):
        room.limits[i] = friction[0]
        if i < first:
            room.limits[i] = np.inf if blocked[0, i // 3] <= instant < blocked[1, i // 3] else 0.0
        sticks = sticks or room.limits[i] > 0.0
    for i in range(1, tree.shape[0]):
        rate = int(tree[i, RATE])
        efforts[rate - size] -= friction[1] * state[rate]
    team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
    if not sticks:
        return
    _motion_of(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.free)
    for i in range(m):
        wanted[i] = -room.rates[i] / (STICKING_TIME if i >= first else BRAKING_TIME) - room.free[i]
    for j in range(m):
        if room.limits[j] == 0.0:
            continue
        _add(j, 1.0, tree, wrenches, efforts, first)
        team_accelerations(tree, bases, places, wrenches, efforts, gravity, state, work, accelerations)
        _add(j, -1.0, tree, wrenches, efforts, first)
        _motion_of(tree, bases, places, state, work, accelerations, room.joints, room.rates, room.pushed)
        for i in range(m):
            room.matrix[i, j] = room.pushed[i] - room.free[i]

    # The forces: which of them are at their limits, and what the others are.
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
    for j in range(m):
        found[j] = min(max(found[j], -room.limits[j]), room.limits[j])
        if room.limits[j] > 0.0:
            _add(j, found[j], tree, wrenches, efforts, first)
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
