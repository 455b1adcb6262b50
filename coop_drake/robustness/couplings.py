"""How strongly a team's masses couple its axes, bounded over all joints of a cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.robustness.waves import (
    NOTHING,
    Collector,
    TeamPoint,
    Wave,
    Waves,
    scaled,
    team_point,
    vector_product,
)
from coop_drake.tree import ComponentTree, TreeJoint
from coop_drake.tree.arrays import FloatArray, IntArray


class Precision(NamedTuple):
    """How near bounds are to what they bound.

    Attributes:
        tolerance: Boxes are halved until a bound is at most this many times what is found in its cell [-].
        floor: Or at most this share of the largest number of its kind for the same axis more [-]:
            coefficients near zero matter little.
        slack: Factor by which coefficients are larger than their bounds [-].
        slack_floor: What they have more of the largest number of their kind [-].
    """

    tolerance: float
    floor: float
    slack: float
    slack_floor: float


OF_ACCELERATIONS = Precision(1.08, 0.02, 1.04, 0.02)
"""Precision of accelerations, whose inverse mass matrix takes many boxes."""

OF_EFFORTS = Precision(1.015, 0.005, 1.01, 0.004)
"""Precision of efforts, which are sums of waves: a tenth of a second for four joints."""

MOST_BOXES = 40_000
"""Boxes that are looked at, for all cells together [-]; what is left then has wider bounds."""


def _pairs(axes: int) -> list[tuple[int, int]]:
    """Return all pairs of axes, of which the second is not the larger one."""
    return [(j, k) for j in range(axes) for k in range(j + 1)]


class Couplings(NamedTuple):
    """Bounds of accelerations in every cell: rows for the position, as a vector's length, then for the axes.

    Attributes:
        rates: By rates of the axes j and k <= j alone, zero for k > j, shape (cells, 1 + axes, axes, axes)
            [m or rad, over the units of both].
        pushes: By a unit of the acceleration that robot r alone commands along x, or along y of L, shape
            (cells, 1 + axes, robots, 2) [- or rad/m].
        efforts: By a unit of effort of a joint, shape (cells, 1 + axes, joints) [1/kg, ...].
    """

    rates: FloatArray
    pushes: FloatArray
    efforts: FloatArray


def cell_couplings(budget: Budget, tree: ComponentTree, cells: Sequence[Cell]) -> Couplings:
    """Return bounds of what couples the axes in every cell, for all values of its joints.

    Args:
        budget: Has the bodies; all bounds are zero without them.
        tree: The team.
        cells: The cells.
    """
    if not budget.bodies:
        return uncoupled(cells)
    n = len(tree.joints)
    axes, robots = 1 + n, budget.robots
    system, pairs = _system(budget, tree), _pairs(axes)
    kinds = np.repeat([0, 1, 2], [len(pairs), 2 * robots, n])
    lower, upper = (np.array([getattr(cell, side)[1:] for cell in cells]) for side in ("lower", "upper"))
    most = refined(lambda c, r: _accelerations(system, c, r), lower, upper, kinds, OF_ACCELERATIONS)
    rates = np.zeros((len(cells), 1 + axes, axes, axes))
    for p, (j, k) in enumerate(pairs):
        rates[:, :, j, k] = most[:, :, p]
    pushes, efforts = most[:, :, kinds == 1], most[:, :, kinds == 2]
    return Couplings(rates, pushes.reshape(len(cells), 1 + axes, robots, 2), efforts)


def uncoupled(cells: Sequence[Cell]) -> Couplings:
    """Return the bounds of a budget without bodies, which are zero."""
    axes = cells[0].lower.size
    rows = len(cells), 1 + axes
    return Couplings(np.zeros((*rows, axes, axes)), np.zeros((*rows, 0, 2)), np.zeros((*rows, axes - 1)))


class TeamCouplings(NamedTuple):
    """What a team's masses couple in the cells of a plan, which does not depend on how large departures are.

    Attributes:
        couplings: Accelerations.
        efforts: Efforts; None where the budget limits none.
    """

    couplings: Couplings
    efforts: Efforts | None


def team_couplings(budget: Budget, tree: ComponentTree, cells: Sequence[Cell]) -> TeamCouplings:
    """Return both; arguments as below."""
    return TeamCouplings(cell_couplings(budget, tree, cells), cell_efforts(budget, tree, cells))


class _System(NamedTuple):
    """M x = f.

    Attributes:
        waves: The functions of M's lower triangle and of f.
        mass: Number of the function of every entry of M, shape (size, size).
        forces: Of every entry of f, shape (size, columns).
    """

    waves: Waves
    mass: IntArray
    forces: IntArray


def _system(budget: Budget, tree: ComponentTree) -> _System:
    """Return mass matrix and right-hand sides: of all pairs of unit rates, pushes of robots, unit efforts."""
    n = len(tree.joints)
    axes, pairs, collect = 1 + n, _pairs(1 + n), Collector()
    still = (0.0,) * n, (0,) * n
    points = [team_point(tree, int(body[0]), body[2], body[3]) for body in budget.bodies]
    bodies = list(zip(points, budget.bodies, strict=True))
    mass, forces = np.zeros((2 + axes, 2 + axes), dtype=np.intp), list[list[int]]()
    one, nothing = collect.add([(*still, 1.0 + 0.0j)]), collect.add([])
    total = collect.add([(*still, complex(sum(body[1] for body in budget.bodies)))])
    mass[:2, :2] = [[total, nothing], [nothing, total]]
    for i in range(axes):
        for row, factor in enumerate((1.0, -1.0j)):
            waves = (scaled(p.slopes.get(i, []), factor * body[1]) for p, body in bodies)
            mass[row, 2 + i] = mass[2 + i, row] = collect.add(chain.from_iterable(waves))
        for j in range(i + 1):
            mass[2 + i, 2 + j] = mass[2 + j, 2 + i] = collect.add(
                _inertia(bodies, i, j, budget.rotors, still)
            )
    for j, k in pairs:
        weight = 1.0 if j == k else 2.0
        forces.append([
            collect.add(chain.from_iterable(scaled(p.bend(j, k), weight * f * b[1]) for p, b in bodies))
            for f in (1.0, -1.0j)
        ] + [
            collect.add(chain.from_iterable(
                vector_product(p.slopes.get(i, []), p.bend(j, k), weight * b[1]) for p, b in bodies
            ))
            for i in range(axes)
        ])  # fmt: skip
    for robot in range(budget.robots):
        own = [(p, b) for p, b in bodies if b[5] == robot]
        moved = collect.add([(*still, complex(sum(b[1] for _, b in own)))])
        for direction, factor in enumerate((1.0, -1.0j)):
            along = [moved if row == direction else nothing for row in range(2)]
            forces.append(along + [
                collect.add(chain.from_iterable(scaled(p.slopes.get(i, []), factor * b[1]) for p, b in own))
                for i in range(axes)
            ])  # fmt: skip
    forces += [[one if row == 3 + joint else nothing for row in range(2 + axes)] for joint in range(n)]
    return _System(collect.waves(n), mass, np.array(forces, dtype=np.intp).T)


def _inertia(
    bodies: Sequence[tuple[TeamPoint, tuple[float, ...]]], i: int, j: int, rotors: Sequence[float],
    still: tuple[tuple[float, ...], tuple[int, ...]],
) -> Iterable[Wave]:  # fmt: skip
    """Yield the entry of the mass matrix of two axes."""
    for point, body in bodies:
        yield from vector_product(point.slopes.get(i, []), point.slopes.get(j, []), body[1])
        yield (*still, complex(body[4] * point.spin(i) * point.spin(j)))
    if i == j and i > 0 and len(rotors):
        yield (*still, complex(rotors[i - 1]))


def _accelerations(
    system: _System, middles: FloatArray, reaches: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return sizes of x = M^-1 f somewhere in boxes, bounds within them, and how much each joint matters.

    Rows x and y become one. Bounds are infinite where the spectral radius of R is not shown to be below one.

    Returns:
        Shape (boxes, size - 1, columns) twice, and (boxes, n).
    """
    value, slope, rest = system.waves.expanded(middles, reaches)
    M, M_slope, M_rest = (part[:, system.mass] for part in (value, slope, rest))
    f, f_slope, f_rest = (part[:, system.forces] for part in (value, slope, rest))
    inverse = np.linalg.inv(M)
    size, x = np.abs(inverse), inverse @ f
    x_slope = np.einsum("bij,bjcl->bicl", inverse, f_slope - np.einsum("bijl,bjc->bicl", M_slope, x))
    by_joint = np.abs(np.einsum("bij,bjkl->bikl", inverse, M_slope)) * reaches[:, None, None]
    first = (np.abs(x_slope) * reaches[:, None, None]).sum(axis=3)
    ratio = by_joint.sum(axis=3) + size @ M_rest
    solved = np.linalg.inv(np.eye(len(system.mass)) - ratio)
    certain = np.all(solved >= 0.0, axis=(1, 2))  # as R >= 0, this is so where its radius is below one
    second = np.abs(solved @ (size @ (f_rest + M_rest @ np.abs(x)) + ratio @ first))
    second = np.where(certain[:, None, None], second, np.inf)
    somewhere = np.maximum(np.abs(x), np.abs(x) + first - second)
    return _lengths(somewhere), _lengths(np.abs(x) + first + second), by_joint.max(axis=(1, 2))


def _lengths(rows: FloatArray) -> FloatArray:
    """Return rows whose first two, coordinates of a vector, have become its length."""
    return np.concatenate([np.hypot(rows[:, :1], rows[:, 1:2]), rows[:, 2:]], axis=1)


_Bounding = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""From middles and half-widths of boxes to sizes that are reached in each, bounds, and how much each joint
matters."""


def refined(
    bounding: _Bounding, lower: FloatArray, upper: FloatArray, kinds: IntArray, precision: Precision
) -> FloatArray:
    """Return bounds over cells, from boxes that are halved until the bounds are tight.

    Args:
        bounding: Bounds in boxes.
        lower: Lower ends of the joints' intervals, shape (cells, n).
        upper: Upper ends, shape (cells, n).
        kinds: Which columns are of the same kind, numbered from 0, shape (columns,).
        precision: How tight they shall be.

    Returns:
        Shape (cells, rows, columns).
    """
    owners, middles, reaches = np.arange(len(lower)), 0.5 * (lower + upper), 0.5 * (upper - lower)
    found, looked = bounding(middles, reaches)[0], 0
    most = np.zeros_like(found)
    while owners.size:
        sizes, bounds, matters = bounding(middles, reaches)
        np.maximum.at(found, owners, sizes)
        allowed = precision.tolerance * found + precision.floor * _largest(found, kinds)
        looked += owners.size
        good = np.all(bounds <= allowed[owners], axis=(1, 2))
        if looked + 2 * (~good).sum() > MOST_BOXES:
            good[:] = True
        np.maximum.at(most, owners[good], bounds[good])
        owners, middles, reaches, axis = (
            owners[~good], middles[~good], reaches[~good], matters[~good].argmax(axis=1)
        )  # fmt: skip
        rows = np.arange(owners.size)
        reaches[rows, axis] *= 0.5
        away = np.zeros_like(middles)
        away[rows, axis] = reaches[rows, axis]
        owners, middles = np.concatenate([owners, owners]), np.concatenate([middles - away, middles + away])
        reaches = np.concatenate([reaches, reaches])
    return precision.slack * most + precision.slack_floor * _largest(most, kinds)


def _largest(numbers: FloatArray, kinds: IntArray) -> FloatArray:
    """Return the largest numbers of every kind of columns, in place of all of its numbers."""
    largest = [numbers[..., kinds == kind].max(axis=-1) for kind in range(kinds.max() + 1)]
    return np.stack(largest, axis=-1)[..., kinds]


class Efforts(NamedTuple):
    """Bounds of what efforts a unit of acceleration or rate takes in every cell, by the models.

    The efforts are the forces of all bases, their torques, then the efforts of all joints in the order of q.

    Attributes:
        push: For the acceleration of the object's origin, shape (cells, efforts) [kg or kg m].
        axes: For that of every axis, shape (cells, efforts, axes).
        rates: For two rates, zero for k > j, shape (cells, efforts, axes, axes).
        damping: For the rate of every axis, by the dampings of the joints, shape (efforts, axes).
        limits: The largest efforts allowed, infinite for no limit, shape (efforts,) [N, N m].
        names: What gives them.
    """

    push: FloatArray
    axes: FloatArray
    rates: FloatArray
    damping: FloatArray
    limits: FloatArray
    names: tuple[str, ...]


QUICKEST = 3.0
"""Largest rate with which nominal axes may turn where efforts are limited [rad/s or m/s]: robots compute
their efforts for joints that are ahead by half a period and the lag, which may be beyond the cell."""


def cell_efforts(budget: Budget, tree: ComponentTree, cells: Sequence[Cell]) -> Efforts | None:
    """Return what efforts accelerations and rates take in every cell; None where the budget limits none.

    A base carries all that its robot moves, and a joint what lies beyond it, seen from the base.

    Args:
        budget: The budget.
        tree: The team.
        cells: The cells.
    """
    if not budget.limited:
        return None
    n, collect, room = len(tree.joints), Collector(), QUICKEST * budget.ahead
    points = [team_point(tree, int(body[0]), body[2], body[3]) for body in budget.bodies]
    bodies = list(zip(points, budget.bodies, strict=True))
    moved = [[(p, b) for p, b in bodies if b[5] == robot] for robot in range(budget.robots)]
    bases = [team_point(tree, int(base[0]), base[1], base[2]) for base in budget.bases]
    functions = [_force(collect, own, n) for own in moved]
    for own, base in zip(moved, bases, strict=True):
        functions.append(_moment(collect, own, base, n, [0.0] * (1 + n)))
    for joint in tree.joints:
        rotor, bearer = (budget.rotors or (0.0,) * n)[joint.index], int(budget.bases[joint.robot][0])
        functions.append(_joint_effort(collect, moved[joint.robot], tree, bearer, joint, rotor))
    names = [f"the base of robot {robot}" for robot in range(budget.robots)] * 2
    names += [f"the joint {joint.name}" for joint in tree.joints]
    damping = np.zeros((len(functions), 1 + n))
    damping[range(2 * budget.robots, len(functions)), range(1, 1 + n)] = budget.dampings or 0.0
    axes, pairs = 1 + n, _pairs(1 + n)
    waves, numbers = collect.waves(n), np.array(functions, dtype=np.intp)
    kinds = np.repeat([0, 1, 2], [1, axes, len(pairs)])
    lower, upper = (np.array([getattr(cell, side)[1:] for cell in cells]) for side in ("lower", "upper"))
    sizes = lambda c, r: _sizes(waves, numbers, c, r)  # noqa: E731
    most = refined(sizes, lower - room, upper + room, kinds, OF_EFFORTS)
    rates = np.zeros((*most.shape[:2], axes, axes))
    for p, (j, k) in enumerate(pairs):
        rates[:, :, j, k] = most[:, :, 1 + axes + p]
    limits = np.array(budget.effort_limits(n))
    return Efforts(most[:, :, 0], most[:, :, 1 : 1 + axes], rates, damping, limits, tuple(names))


def _sizes(
    waves: Waves, numbers: IntArray, middles: FloatArray, reaches: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lengths of vectors of two functions each, as ``refined`` needs them.

    Across the vector in the middle a change adds by its square alone.

    Args:
        waves: The functions.
        numbers: The functions of every vector, shape (rows, columns, 2).
        middles: Of boxes, shape (boxes, n).
        reaches: Half-widths, shape (boxes, n).
    """
    value, slope, rest = (part[:, numbers] for part in waves.expanded(middles, reaches))
    sizes, second = np.linalg.norm(value, axis=3), np.linalg.norm(rest, axis=3)
    ahead = value / np.maximum(sizes, NOTHING)[..., None]
    aside = np.stack([-ahead[..., 1], ahead[..., 0]], axis=3)
    along, across = (np.abs(np.einsum("bijd,bijdn->bijn", one, slope)) for one in (ahead, aside))
    turned = reaches[:, None, None]
    first = (along * turned).sum(axis=3)
    bounds = np.hypot(sizes + first, (across * turned).sum(axis=3)) + second
    bounds = np.where(sizes > NOTHING, bounds, (np.linalg.norm(slope, axis=3) * turned).sum(axis=3) + second)
    reached = np.maximum(sizes, sizes + first - second)
    return reached, bounds, ((along + across) * turned).max(axis=(1, 2))


_Moved = Sequence[tuple[TeamPoint, tuple[float, ...]]]
"""Bodies that an effort accelerates: their centres of mass, and what the budget states of them."""

_Weighing = Callable[[TeamPoint, Sequence[Wave]], Iterable[Wave]]
"""From a body's centre of mass and its acceleration to the part of an effort for each kilogram."""


def _row(
    collect: Collector, moved: _Moved, weighing: _Weighing, lever: list[Wave], turning: Sequence[float],
    *, force: bool,
) -> list[list[int]]:  # fmt: skip
    """Add an effort: for the object's origin, for every axis, and for every pair of rates.

    Args:
        collect: Receives the functions.
        moved: What it accelerates.
        weighing: What each body takes.
        lever: The vector whose product with the acceleration of the object's origin is the effort.
        turning: What it takes for every axis besides: inertias that turn, and rotors, shape (axes,).
        force: Whether the effort is a vector.
    """
    still, axes = ((0.0,) * (len(turning) - 1), (0,) * (len(turning) - 1)), range(len(turning))
    columns = [lever]
    for i in axes:
        own = [w for p, b in moved for w in scaled(weighing(p, p.slopes.get(i, [])), b[1])]
        columns.append([*own, (*still, complex(turning[i]))])
    for j, k in _pairs(len(turning)):
        weight = 1.0 if j == k else 2.0
        columns.append([w for p, b in moved for w in scaled(weighing(p, p.bend(j, k)), weight * b[1])])
    nothing = collect.add([])
    return [
        [collect.add(column), collect.add(scaled(column, -1.0j)) if force or not i else nothing]
        for i, column in enumerate(columns)
    ]


def _force(collect: Collector, moved: _Moved, joints: int) -> list[list[int]]:
    """Add the force that accelerates bodies."""
    mass = [((0.0,) * joints, (0,) * joints, complex(sum(body[1] for _, body in moved)))]
    return _row(collect, moved, lambda _, waves: waves, mass, [0.0] * (1 + joints), force=True)


def _moment(
    collect: Collector, moved: _Moved, about: TeamPoint, joints: int, rotors: Sequence[float]
) -> list[list[int]]:
    """Add the moment that accelerates bodies, about a point; ``rotors`` are what it turns besides."""

    def arm(point: TeamPoint) -> list[Wave]:
        return [*point.place, *scaled(about.place, -1.0)]

    lever = [wave for p, b in moved for wave in scaled(arm(p), b[1])]
    turning = [sum(b[4] * p.spin(i) for p, b in moved) + rotors[i] for i in range(1 + joints)]
    product = lambda p, waves: vector_product(arm(p), waves, -1.0j)  # noqa: E731
    return _row(collect, moved, product, lever, turning, force=False)


def _joint_effort(
    collect: Collector, own: _Moved, tree: ComponentTree, bearer: int, joint: TreeJoint, rotor: float
) -> list[list[int]]:
    """Add the effort of a joint: it accelerates what the robot moves on the side without its base."""
    child = next(i for i, component in enumerate(tree.components) if component.joint is joint)
    parent, n = tree.components[child].parent, len(tree.joints)
    assert parent is not None
    behind = child in tree.ancestors[bearer]
    moved = [(p, b) for p, b in own if (child in tree.ancestors[int(b[0])]) != behind]
    rotors = [rotor * (axis == 1 + joint.index) for axis in range(1 + n)]
    if joint.kind == "revolute":
        rotors = [joint.sign * inertia for inertia in rotors]  # of a moment that turns what lies beyond
        return _moment(collect, moved, team_point(tree, parent, joint.X_PJ.x, joint.X_PJ.y), n, rotors)
    along = team_point(tree, child, 0.0, 0.0).slopes[1 + joint.index]
    lever = scaled(along, sum(body[1] for _, body in moved))
    return _row(
        collect, moved, lambda _, waves: vector_product(along, waves, 1.0), lever, rotors, force=False
    )
