"""Bounds of what a team's masses couple, over all joints of a cell, by Lagrange's equations.

With M = sum m J^T J + I w^T w and unit rates of axes j and k, axis i is accelerated by -(M^-1 g)_i, where g
is the sum of m J^T times the second derivative of the body's position by j and k. First derivatives are taken
by an imaginary step, without rounding, and second ones as their differences.

All of this depends on a joint that turns by waves exp(i k q) with k = -1, 0, 1 alone, and on one that slides
by powers up to its square. So three values of every joint determine it everywhere: a Fourier transform gives
the waves, and with them values, slopes, and bounds of what a box adds to these.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.kinematics import Stage, component_stages, points_in_world

IMAGINARY, STEP = 1e-30, 1e-5
"""Imaginary step, and step of the difference of first derivatives [rad or m]."""

ACCELERATIONS, EFFORTS = (1.035, 0.017), (1.008, 0.003)
"""Boxes are halved until a bound is at most so many times what is reached in its cell, or so much of the
largest number of its kind more [-]."""

MOST_BOXES = 150_000
"""Boxes that are looked at [-]; what is left then has wider bounds."""

BATCH = 4000
"""Boxes that are looked at in one go [-]."""

SMALL = 1e-9
"""Waves below this are rounding, and count with all of their size where a box is bounded [kg m^2 or less]."""


class Coupled(NamedTuple):
    """Bounds in every cell.

    Attributes:
        rates: Accelerations of the position, as a length, and of the axes because of rates of the axes j and
            k <= j, zero for k > j, shape (cells, 1 + axes, axes, axes).
        pushes: Because of a unit of acceleration that a robot alone commands along x, or y, shape (cells,
            1 + axes, robots, 2).
        efforts: Because of a unit of effort of each joint, shape (cells, 1 + axes, n).
    """

    rates: FloatArray
    pushes: FloatArray
    efforts: FloatArray


def couplings(budget: Budget, tree: ComponentTree, cells: tuple[Cell, ...]) -> Coupled:
    """Return the bounds; all are zero in a budget without bodies."""
    n = len(tree.joints)
    axes, robots, size = 1 + n, budget.robots, 3 + n
    rows = len(cells), 1 + axes
    if not budget.bodies:
        return Coupled(np.zeros((*rows, axes, axes)), np.zeros((*rows, 0, 2)), np.zeros((*rows, n)))
    columns = axes * axes + 2 * robots

    def functions(z: FloatArray) -> FloatArray:
        motion = _motion(budget, tree, z)
        mass, forces = np.zeros((len(z), size, size)), np.zeros((len(z), size, columns))
        for (_, m, _, _, inertia, robot), moved, bent, spun in motion:
            mass += m * np.einsum("cip,cjp->cij", moved, moved) + inertia * np.outer(spun, spun)
            rates = m * np.einsum("cip,cjkp->cijk", moved, bent)
            forces[:, :, : axes * axes] += _lower(rates).reshape(len(z), size, -1)
            forces[:, :, axes * axes + 2 * int(robot) :][:, :, :2] += m * moved
        rotors = range(3, 3 + len(budget.rotors))
        mass[:, rotors, rotors] += budget.rotors
        return np.concatenate([mass, forces], axis=2).reshape(len(z), -1)

    waves = _waves_of(functions, tree)
    kinds = np.repeat([0, 1, 2], [axes * axes, 2 * robots, n])
    lower, upper = (np.array([getattr(cell, side)[1:] for cell in cells]) for side in ("lower", "upper"))
    most = _largest(lambda q, r: _solved(waves, size, n, q, r), lower, upper, kinds, ACCELERATIONS)
    pushes = most[:, :, axes * axes : columns]
    return Coupled(
        most[:, :, : axes * axes].reshape(*rows, axes, axes),
        pushes.reshape(*rows, robots, 2),
        most[:, :, columns:],
    )


def effort_shares(
    budget: Budget, tree: ComponentTree, cells: tuple[Cell, ...], room: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what efforts take for the object's acceleration, for axes and for rates, at most, in every cell.

    The efforts are the forces of all bases, their torques, and the efforts of all joints. Each is a sum over
    bodies that its robot moves: of their inertia forces, or of the moments of these about what gives it.

    Args:
        budget: The budget.
        tree: The team.
        cells: The cells.
        room: How far beyond each cell joints may be, shape (cells,) [rad or m].

    Returns:
        Shape (cells, efforts), (cells, efforts, axes) and (cells, efforts, axes, axes).
    """
    n = len(tree.joints)
    axes, columns = 1 + n, 2 + n + (1 + n) ** 2
    givers = _givers(budget, tree)

    def functions(z: FloatArray) -> FloatArray:
        motion = _motion(budget, tree, z)
        places = [_place(budget.bodies[b][0], budget.bodies[b][2:4], tree, z) for b in range(len(motion))]
        found = np.zeros((len(z), len(givers), columns, 2))
        for e, giver in enumerate(givers):
            at = _place(giver.component, giver.point, tree, z)
            along = _place(giver.component, giver.tip, tree, z) - at
            for (_, m, _, _, inertia, _), moved, bent, spun, place, carried in zip(
                *zip(*motion, strict=True), places, giver.carries, strict=True
            ):
                if not carried:
                    continue
                rates = _lower(bent[:, None])[:, 0].reshape(len(z), -1, 2)
                forces = m * np.concatenate([np.zeros((len(z), 1, 2)), moved[:, 2:], rates], axis=1)
                if giver.kind == "force":
                    found[:, e] += forces
                    found[:, e, 0, 0] += m
                elif giver.kind == "slide":
                    found[:, e, :, 0] += np.einsum("cip,cp->ci", forces, along)
                    found[:, e, 0] += m * along
                else:
                    arm = place - at
                    found[:, e, :, 0] += arm[:, None, 0] * forces[..., 1] - arm[:, None, 1] * forces[..., 0]
                    found[:, e, 0] += m * arm
                    found[:, e, 1 : 1 + axes, 0] += inertia * spun[2:]
            if giver.joint is not None and budget.rotors:
                found[:, e, 2 + giver.joint, 0] += budget.rotors[giver.joint] * giver.sign
        return found.reshape(len(z), -1)

    waves, kinds = _waves_of(functions, tree), np.repeat([0, 1, 2], [1, axes, axes * axes])
    lower, upper = (np.array([getattr(cell, side)[1:] for cell in cells]) for side in ("lower", "upper"))

    def sizes(q: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        value, slope, rest = waves(q, r)
        vectors = (len(q), len(givers), columns, 2)
        now, changes = value.reshape(vectors), slope.reshape(*vectors, n) * r[:, None, None, None]
        length, left = np.linalg.norm(now, axis=3), np.linalg.norm(rest.reshape(vectors), axis=3)
        heading = np.where(length > SMALL, np.arctan2(now[..., 1], now[..., 0]), 0.0)[..., None]
        c, s = np.cos(heading), np.sin(heading)
        along = np.abs(c * changes[..., 0, :] + s * changes[..., 1, :])
        across = np.abs(c * changes[..., 1, :] - s * changes[..., 0, :])
        first = along.sum(axis=3)
        bound = np.hypot(length + first, across.sum(axis=3)) + left
        return np.maximum(length, length + first - left), bound, (along + across).max(axis=(1, 2))

    most = _largest(sizes, lower - room[:, None], upper + room[:, None], kinds, EFFORTS)
    rates = most[:, :, 1 + axes :].reshape(len(cells), len(givers), axes, axes)
    return most[:, :, 0], most[:, :, 1 : 1 + axes], rates


class _Giver(NamedTuple):
    """What gives an effort.

    Attributes:
        kind: ``force``, ``moment`` about a point, or ``slide`` along a direction.
        component: The component of its point.
        point: The point, in the component's frame [m].
        tip: A point that is a unit away in the direction in which it slides [m].
        carries: Which bodies it accelerates.
        joint: Index of its joint, None for a base.
        sign: How the joint's value turns what lies beyond it, seen from the object.
    """

    kind: str
    component: int
    point: tuple[float, float]
    tip: tuple[float, float]
    carries: tuple[bool, ...]
    joint: int | None = None
    sign: float = 1.0


def _givers(budget: Budget, tree: ComponentTree) -> list[_Giver]:
    """Return what gives all efforts."""
    found = []
    for kind in ("force", "moment"):
        for robot, (component, x, y) in enumerate(budget.bases):
            own = tuple(body[5] == robot for body in budget.bodies)
            found.append(_Giver(kind, int(component), (x, y), (x, y), own))
    for joint in tree.joints:
        child = next(i for i, one in enumerate(tree.components) if one.joint is joint)
        with_base = child in tree.ancestors[int(budget.bases[joint.robot][0])]
        carries = tuple(
            body[5] == joint.robot and (child in tree.ancestors[int(body[0])]) != with_base
            for body in budget.bodies
        )
        tip = (float(joint.axis[0]), float(joint.axis[1]))
        kind, sign = ("moment", joint.sign) if joint.kind == "revolute" else ("slide", 1.0)
        found.append(_Giver(kind, child, (0.0, 0.0), tip, carries, joint.index, sign))
    return found


def _lower(rates: FloatArray) -> FloatArray:
    """Return pairs of rates (c, i, j, k, ...) of which those with k > j are added to those with k < j."""
    both = rates + np.swapaxes(rates, 2, 3)
    axes = rates.shape[2]
    mask = np.tril(np.ones((axes, axes)), -1) + 0.5 * np.eye(axes)
    result: FloatArray = both * mask.reshape(1, 1, axes, axes, *[1] * (rates.ndim - 4))
    return result


_Motion = tuple[tuple[float, ...], FloatArray, FloatArray, FloatArray]
"""What a budget states of a body, and its J, its second derivatives, and its turns by all coordinates."""


def _motion(budget: Budget, tree: ComponentTree, z: FloatArray) -> list[_Motion]:
    """Return how all bodies move, with the shapes (c, size, 2), (c, axes, axes, 2) and (size,)."""
    size, found = z.shape[1], list[_Motion]()
    for body in budget.bodies:
        stages, point = component_stages(tree, int(body[0])), np.array([body[2:4]])
        spun = np.zeros(size)
        for stage in stages:
            spun[2 + stage.axis] = stage.scale if stage.kind == "revolute" else 0.0
        bent = np.empty((len(z), size - 2, size - 2, 2))
        for k in range(size - 2):
            away = STEP * np.eye(size)[2 + k]
            second = _derivatives(point, stages, z + away) - _derivatives(point, stages, z - away)
            bent[:, :, k] = second[:, 2:] / (2.0 * STEP)
        found.append((body, _derivatives(point, stages, z), bent, spun))
    return found


def _derivatives(point: FloatArray, stages: tuple[Stage, ...], z: FloatArray) -> FloatArray:
    """Return the derivatives of a body's position by all coordinates, shape (configurations, 3 + n, 2)."""
    size = z.shape[1]
    steps = [points_in_world(point, stages, z + 1j * IMAGINARY * np.eye(size)[j]) for j in range(size)]
    return np.stack([step[:, 0].imag for step in steps], axis=1) / IMAGINARY


def _place(component: float, point: tuple[float, ...], tree: ComponentTree, z: FloatArray) -> FloatArray:
    """Return where a point of a component is, shape (configurations, 2) [m]."""
    placed: FloatArray = points_in_world(np.array([point]), component_stages(tree, int(component)), z)[:, 0]
    return placed


_Waves = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""From middles and half-widths of boxes, shape (boxes, n) each, to values and slopes of all functions in the
middles, and bounds of what is left in the boxes: shape (boxes, f), (boxes, f, n) and (boxes, f)."""


def _waves_of(functions: Callable[[FloatArray], FloatArray], tree: ComponentTree) -> _Waves:
    """Return functions of configurations, shape (c, 3 + n) to (c, f), as sums of waves."""
    n, sliding = len(tree.joints), [joint.kind == "prismatic" for joint in tree.joints]
    turns, thirds = np.array([-1.0, 0.0, 1.0]), 2.0 * np.pi / 3.0
    spots = [np.array([-1.0, 0.0, 1.0]) if slides else thirds * np.arange(3.0) for slides in sliding]
    z = np.zeros((3**n, 3 + n))
    z[:, 3:] = list(product(*spots))
    sizes = functions(z).reshape(*[3] * n, -1).astype(complex)
    for j, slides in enumerate(sliding):
        basis = spots[j][:, None] ** np.arange(3) if slides else np.exp(1j * np.outer(spots[j], turns))
        sizes = np.moveaxis(np.tensordot(np.linalg.inv(basis), sizes, (1, j)), 0, j)
    sizes = sizes.reshape(3**n, -1)
    numbers = np.array(list(product(range(3), repeat=n)))
    power, turned = np.where(sliding, numbers, 0), np.where(sliding, 0.0, turns[numbers])
    kept = np.abs(sizes).max(axis=1) > SMALL
    lost = np.abs(sizes[~kept]).sum(axis=0)
    return _expansion(sizes[kept], power[kept], turned[kept], lost)


def _expansion(
    sizes: NDArray[np.complex128], power: IntArray, turned: FloatArray, lost: FloatArray
) -> _Waves:
    """Return the waves as a function of boxes.

    Args:
        sizes: Sizes of all waves in all functions, shape (waves, f).
        power: Exponents of each joint, shape (waves, n).
        turned: Turns by each joint, shape (waves, n).
        lost: Sizes of waves that are left out, shape (f,).
    """
    magnitudes, slides = np.abs(sizes), bool(power.any())

    def expansion(q: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        wave, swept = np.exp(1j * (q @ turned.T)), r @ np.abs(turned).T
        slopes = 1j * wave[:, :, None] * turned
        rest = 0.5 * swept**2
        if slides:
            raised = q[:, None] ** power
            height = raised.prod(axis=2)
            steeper = np.empty_like(slopes, dtype=float)
            for j in range(q.shape[1]):
                less = np.maximum(power[:, j] - 1, 0)
                others = np.delete(raised, j, axis=2).prod(axis=2)
                steeper[:, :, j] = power[:, j] * q[:, None, j] ** less * others
            slopes = height[:, :, None] * slopes + wave[:, :, None] * steeper
            wave = height * wave
            first = (np.abs(steeper) * r[:, None]).sum(axis=2)
            highest = ((np.abs(q) + r)[:, None] ** power).prod(axis=2)
            rest = np.abs(height) * rest + first * swept + highest - np.abs(height) - first
        slope = np.stack([(slopes[:, :, j] @ sizes).real for j in range(q.shape[1])], axis=2)
        return (wave @ sizes).real, slope, rest @ magnitudes + lost

    return expansion


def _solved(
    waves: _Waves, size: int, joints: int, q: FloatArray, r: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the size of M^-1 f somewhere in boxes, bounds of it, and how much each joint matters.

    M (x - x_0 - x_1 d) is of second order in d: what is left of f, less what is left of M times x_0, less the
    change of M times x_1 d. The inverse of M is at most that in the middle, over one less the change of M.
    """
    value, slope, rest = (part.reshape(len(q), size, -1, *part.shape[2:]) for part in waves(q, r))
    units = np.zeros((len(q), size, joints))
    units[:, range(3, 3 + joints), range(joints)] = 1.0
    mass, forces = value[:, :, :size], np.concatenate([value[:, :, size:], units], axis=2)
    inverse = np.linalg.inv(mass)
    x, sized = inverse @ forces, np.abs(inverse)
    none = np.zeros((len(q), size, joints))
    left = np.concatenate([rest[:, :, size:], none], axis=2) + rest[:, :, :size] @ np.abs(x)
    change, first = sized @ rest[:, :, :size], np.zeros_like(x)
    matters = np.empty((len(q), joints))
    for j in range(joints):
        turned = inverse @ slope[:, :, :size, j]
        by_force = np.concatenate([slope[:, :, size:, j], none], axis=2)
        first += np.abs(inverse @ by_force - turned @ x) * r[:, j, None, None]
        changed = np.abs(turned) * r[:, j, None, None]
        change, matters[:, j] = change + changed, changed.max(axis=(1, 2))
    larger = np.linalg.inv(np.eye(size) - change)
    second = np.abs(larger @ (sized @ left + change @ first))
    second = np.where(np.all(larger >= 0.0, axis=(1, 2))[:, None, None], second, np.inf)
    both = np.maximum(np.abs(x), np.abs(x) + first - second), np.abs(x) + first + second
    reached, bound = (np.concatenate([np.hypot(a[:, :1], a[:, 1:2]), a[:, 2:]], axis=1) for a in both)
    return reached, bound, matters


def _largest(
    bounds: _Waves, lower: FloatArray, upper: FloatArray, kinds: IntArray, precision: tuple[float, float]
) -> FloatArray:
    """Return bounds over cells, shape (cells, rows, columns), from boxes that are halved until they suffice.

    Args:
        bounds: Sizes that are reached in boxes, bounds in them, and how much each joint matters.
        lower: Lower ends of the joints' intervals, shape (cells, n).
        upper: Upper ends, shape (cells, n).
        kinds: The kind of every column, shape (columns,).
        precision: When they suffice.
    """
    cell, q, r = np.arange(len(lower)), 0.5 * (lower + upper), 0.5 * (upper - lower)
    found = bounds(q, r)[0]
    most, looked = np.zeros_like(found), 0
    while cell.size:
        parts = [bounds(q[i : i + BATCH], r[i : i + BATCH]) for i in range(0, cell.size, BATCH)]
        now, bound, matters = (np.concatenate(own) for own in zip(*parts, strict=True))
        np.maximum.at(found, cell, now)
        highest = np.stack([found[..., kinds == kind].max(axis=-1, initial=0.0) for kind in kinds], axis=-1)
        tight = np.all(bound <= (precision[0] * found + precision[1] * highest)[cell], axis=(1, 2))
        looked += cell.size
        if looked > MOST_BOXES:
            tight[:] = True
        np.maximum.at(most, cell[tight], bound[tight])
        cell, q, r, along = cell[~tight], q[~tight], r[~tight], matters[~tight].argmax(axis=1)
        away = np.zeros_like(q)
        rows = np.arange(cell.size)
        r[rows, along] *= 0.5
        away[rows, along] = r[rows, along]
        cell, q, r = np.tile(cell, 2), np.concatenate([q - away, q + away]), np.tile(r, (2, 1))
    return most
