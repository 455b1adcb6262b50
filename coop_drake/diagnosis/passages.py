"""Stretches of a way that stick out of the floor, with the bodies that do so and the angles at which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.contacts import Contact, contacts
from coop_drake.diagnosis.gap import Gap, narrowest_gap
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.questions.margins import exact_footprint
from coop_drake.tree.pose import FloatArray

__all__ = ["BodyAtFault", "Stretch", "stretches"]

_NOTICED = 0.05
_APART = 0.3
_LEAD = 0.15
_ROOM = 0.15


@dataclass(frozen=True)
class BodyAtFault:
    """A body that sticks out of the floor on a stretch.

    Attributes:
        name: Its name.
        robot: Its robot, None for the object.
        depth: How far it sticks out at most [m].
        axes: Names of the axes that move it: ``theta`` and the joints between it and the object.
        intervals: Interval of each of these over the configurations at which it sticks out [rad or m].
    """

    name: str
    robot: int | None
    depth: float
    axes: tuple[str, ...]
    intervals: tuple[Interval, ...]


@dataclass(frozen=True)
class Stretch:
    """One stretch of a way on which the team sticks out of the floor.

    Attributes:
        configuration: Where it sticks out most on two sides together, shape (3 + n,) [m, rad].
        contacts: What sticks out there, the deepest first.
        gap: The walls that pinch it there, None if only one wall is in the way.
        bodies: All bodies that stick out on the stretch, the deepest first.
        limits: Names of the joints that reach a limit on the stretch.
        zone: The floor that the team takes on the stretch, and some room around it, in W [m].
        squeeze: How far the team sticks out there, both sides together [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    gap: Gap | None
    bodies: tuple[BodyAtFault, ...]
    limits: tuple[str, ...]
    zone: BaseGeometry
    squeeze: float


def stretches(problem: PlanningProblem, way: FloatArray) -> list[Stretch]:
    """The stretches of a way on which the team sticks out of the floor, in the way's order.

    What sticks out by less than a twentieth of the worst is left out.

    Args:
        problem: The question, with the floor as it is.
        way: Configurations from start to goal, shape (m, 3 + n) [m, rad].
    """
    found = [contacts(problem.workspace, problem.tree, z) for z in way]
    out = np.array([max((contact.depth for contact in here), default=0.0) for here in found])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way[:, :2], axis=0).T))))
    least = _NOTICED * float(out.max())
    found = [[contact for contact in here if contact.depth > least] for here in found]
    return [_stretch(problem, way, found, rows, along) for rows in _runs(out > least, along)]


def _runs(noticed: NDArray[np.bool_], along: FloatArray) -> list[list[int]]:
    """Rows that are noticed, cut where the way between two of them is long."""
    rows = np.flatnonzero(noticed)
    if len(rows) == 0:
        return []
    gaps = (np.diff(along[rows]) > _APART) & (np.diff(rows) > 1)
    return [[int(row) for row in run] for run in np.split(rows, np.flatnonzero(gaps) + 1)]


def _stretch(
    problem: PlanningProblem,
    way: FloatArray,
    found: Sequence[Sequence[Contact]],
    rows: Sequence[int],
    along: FloatArray,
) -> Stretch:
    squeezes = [_squeeze(found[row]) for row in rows]
    tightest = rows[squeezes.index(max(squeezes))]
    touched = [contact.wall for contact in found[tightest]]
    lead = (along >= along[rows[0]] - _LEAD) & (along <= along[rows[-1]] + _LEAD)
    taken = shapely.union_all([exact_footprint(problem.tree, z) for z in way[lead]])
    return Stretch(
        configuration=way[tightest],
        contacts=tuple(found[tightest]),
        gap=narrowest_gap(problem.workspace, touched),
        bodies=_bodies(problem, way, found, rows),
        limits=_limits(problem, way[rows]),
        zone=taken.buffer(_ROOM, quad_segs=4),
        squeeze=max(squeezes),
    )


def _squeeze(found: Sequence[Contact]) -> float:
    """How far two contacts on different sides reach together; in a gap that does not depend on the place."""
    best = found[0].depth
    for number, first in enumerate(found):
        out = (first.point - first.wall) / first.depth
        for second in found[number + 1 :]:
            if float(out @ (second.point - second.wall)) < 0.0:
                best = max(best, first.depth + second.depth)
    return best


def _bodies(
    problem: PlanningProblem, way: FloatArray, found: Sequence[Sequence[Contact]], rows: Sequence[int]
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
        values = way[places[name]][:, columns]
        intervals = tuple(
            (float(low), float(high))
            for low, high in zip(values.min(axis=0), values.max(axis=0), strict=True)
        )
        bodies.append(BodyAtFault(name, contact.robot, contact.depth, axes, intervals))
    return tuple(sorted(bodies, key=lambda body: (-body.depth, body.name)))


def _axes(problem: PlanningProblem, name: str) -> tuple[list[int], tuple[str, ...]]:
    """Columns of z that turn a body against the floor, and their names."""
    tree = problem.tree
    (index,) = [i for i, c in enumerate(tree.components) if any(body.name == name for body in c.bodies)]
    joints = [tree.components[i].joint for i in tree.ancestors[index]]
    moving = sorted((joint for joint in joints if joint is not None), key=lambda joint: joint.index)
    return [2, *(3 + joint.index for joint in moving)], ("theta", *(joint.name for joint in moving))


def _limits(problem: PlanningProblem, way: FloatArray) -> tuple[str, ...]:
    """Joints that come within a fiftieth of their range of a limit."""
    near = []
    for joint in problem.tree.joints:
        values, hair = way[:, 3 + joint.index], 0.02 * (joint.upper - joint.lower)
        if values.min() <= joint.lower + hair or values.max() >= joint.upper - hair:
            near.append(joint.name)
    return tuple(near)
