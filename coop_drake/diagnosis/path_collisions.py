"""Stretches of a path on which the team collides with walls: which bodies, how deep, at which angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.contacts import Contact, contacts
from coop_drake.diagnosis.gap import Gap, narrowest_gap
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.questions import exact_footprint
from coop_drake.tree.pose import FloatArray

NOTICED = 0.05
"""Collisions less deep than this fraction of the deepest one on the path are left out [-]."""

APART = 0.3
"""Collisions further apart along the path than this belong to two stretches [m]."""

LEAD, BORDER = 0.15, 0.15
"""Length of path before and after a stretch, and border around the team, that its zone includes [m]."""

AT_LIMIT = 0.02
"""A joint is at its limit if it is nearer to it than this fraction of its range [-]."""


@dataclass(frozen=True)
class BodyAtFault:
    """A body that collides with a wall on a stretch.

    Attributes:
        name: Its name.
        robot: Its robot, None for the object.
        depth: How far it leaves the floor at most [m].
        axes: Names of the axes that move it: ``theta`` and the joints between it and the object.
        intervals: Interval of each of these over the configurations in collision [rad or m].
    """

    name: str
    robot: int | None
    depth: float
    axes: tuple[str, ...]
    intervals: tuple[Interval, ...]


@dataclass(frozen=True)
class CollidingStretch:
    """One stretch of a path on which the team collides with walls.

    Attributes:
        configuration: Where it leaves the floor most, on two sides together, shape (3 + n,) [m, rad].
        contacts: The collisions there, the deepest first.
        gap: The walls on both sides there, None if only one wall is in the way.
        bodies: All bodies that collide on the stretch, the deepest first.
        limits: Names of the joints that reach a limit on the stretch.
        zone: What the team covers on the stretch, with a border, in W [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    gap: Gap | None
    bodies: tuple[BodyAtFault, ...]
    limits: tuple[str, ...]
    zone: BaseGeometry


def colliding_stretches(problem: PlanningProblem, path: FloatArray) -> list[CollidingStretch]:
    """The stretches of a path on which the team collides with walls, in the path's order.

    The path has configurations from start to goal, shape (m, 3 + n) [m, rad], the problem the floor as it is.
    """
    found = [contacts(problem.workspace, problem.tree, z) for z in path]
    deepest = np.array([max((contact.depth for contact in here), default=0.0) for here in found])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))))
    least = NOTICED * float(deepest.max())
    found = [[contact for contact in here if contact.depth > least] for here in found]
    rows = np.flatnonzero(deepest > least)
    cuts = np.flatnonzero((np.diff(along[rows]) > APART) & (np.diff(rows) > 1)) + 1
    runs = np.split(rows, cuts) if len(rows) else []
    return [_stretch(problem, path, found, run.tolist(), along) for run in runs]


def _stretch(
    problem: PlanningProblem,
    path: FloatArray,
    found: Sequence[Sequence[Contact]],
    rows: Sequence[int],
    along: FloatArray,
) -> CollidingStretch:
    tightest = max(rows, key=lambda row: _depth_on_both_sides(found[row]))
    touched = [contact.wall for contact in found[tightest]]
    near = (along >= along[rows[0]] - LEAD) & (along <= along[rows[-1]] + LEAD)
    covered = shapely.union_all([exact_footprint(problem.tree, z) for z in path[near]])
    return CollidingStretch(
        configuration=path[tightest],
        contacts=tuple(found[tightest]),
        gap=narrowest_gap(problem.workspace, touched),
        bodies=_bodies(problem, path, found, rows),
        limits=_limits(problem, path[rows]),
        zone=covered.buffer(BORDER, quad_segs=4),
    )


def _depth_on_both_sides(found: Sequence[Contact]) -> float:
    """Depth of two contacts on opposite sides together: in a gap it is the same at all positions."""
    best = found[0].depth
    for number, first in enumerate(found):
        out = (first.point - first.wall) / first.depth
        for second in found[number + 1 :]:
            if float(out @ (second.point - second.wall)) < 0.0:
                best = max(best, first.depth + second.depth)
    return best


def _bodies(
    problem: PlanningProblem, path: FloatArray, found: Sequence[Sequence[Contact]], rows: Sequence[int]
) -> tuple[BodyAtFault, ...]:
    places: dict[str, list[int]] = {}
    worst: dict[str, Contact] = {}
    for row in rows:
        for contact in found[row]:
            places.setdefault(contact.body, []).append(row)
            if contact.body not in worst or contact.depth > worst[contact.body].depth:
                worst[contact.body] = contact
    bodies = []
    for name, contact in worst.items():
        columns, axes = _axes(problem, name)
        values = path[places[name]][:, columns]
        intervals = tuple(
            (float(low), float(high))
            for low, high in zip(values.min(axis=0), values.max(axis=0), strict=True)
        )
        bodies.append(BodyAtFault(name, contact.robot, contact.depth, axes, intervals))
    return tuple(sorted(bodies, key=lambda body: (-body.depth, body.name)))


def _axes(problem: PlanningProblem, name: str) -> tuple[list[int], tuple[str, ...]]:
    """Columns of z that change a body's angle in W, and their names."""
    tree = problem.tree
    (index,) = [i for i, c in enumerate(tree.components) if any(body.name == name for body in c.bodies)]
    joints = [tree.components[i].joint for i in tree.ancestors[index]]
    moving = sorted((joint for joint in joints if joint is not None), key=lambda joint: joint.index)
    return [2, *(3 + joint.index for joint in moving)], ("theta", *(joint.name for joint in moving))


def _limits(problem: PlanningProblem, path: FloatArray) -> tuple[str, ...]:
    """Names of joints that come near a limit."""
    near = []
    for joint in problem.tree.joints:
        if joint.circular:
            continue
        values, near_limit = path[:, 3 + joint.index], AT_LIMIT * (joint.upper - joint.lower)
        if values.min() <= joint.lower + near_limit or values.max() >= joint.upper - near_limit:
            near.append(joint.name)
    return tuple(near)
