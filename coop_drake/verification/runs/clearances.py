"""Check that no body met a wall or another body, in the rows of a log and between them.

Between two rows a distance changes by no more than the bodies travel. Where that is not enough, the chord
between both configurations is divided; bodies are as near to it as ``Between`` says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.progress import Progress
from coop_drake.tree.component_tree import TreeJoint
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.kinematics import (
    Solid,
    checked_pairs,
    levers,
    points_in_world,
    team_solids,
)
from coop_drake.verification.runs.rows import Between, Rows

PARTS = (2, 4, 8, 16, 32, 64)
"""Into how many parts the chord between two rows is divided, tried in this order."""

ENOUGH = 0.5
"""A bound between two rows need not be tighter than this fraction of the distance at the rows [-]."""

ROUNDING = 1e-8
"""Distances that are computed twice may differ by so much [m]: a millionth of what matters."""


@dataclass(frozen=True)
class _Distance:
    """One distance that must stay positive.

    Attributes:
        name: What it is between, in words.
        array: Name of the log's array that holds the smallest of its kind.
        measure: From configurations (T, 3 + n) to signed distances (T,) [m].
        stages: Stages that change it, with a bound of how much for each unit of the axis; an axis may occur
            twice.
        moves: Whether it changes with the object's position, too.
    """

    name: str
    array: str
    measure: Callable[[FloatArray], FloatArray]
    stages: tuple[tuple[TreeJoint, float], ...]
    moves: bool

    def travel(self, amounts: FloatArray) -> FloatArray:
        """Bound of the distance's change for changes (m, 3 + n) of the coordinates, shape (m,) [m]."""
        amounts = np.abs(amounts)
        total = np.hypot(amounts[:, 0], amounts[:, 1]) if self.moves else np.zeros(len(amounts))
        for stage, lever in self.stages:
            total = total + lever * amounts[:, 3 + stage.index]
        return total


def check_clearances(
    rows: Rows, between: Between, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, Check]:
    """Check that nothing touched, and that the stated clearances are the smallest distances.

    Raises:
        RefusalError: Names array, index and time, and what may have touched.
    """
    distances = _distances(problem, rows.z)
    smallest = {name: np.full(len(rows.z), np.inf) for name in ("workspace_clearance", "body_clearance")}
    least = np.inf
    for k, distance in enumerate(distances):
        gaps = distance.measure(rows.z)
        rows.require(gaps > 0.0, distance.array, f"{distance.name} touch")
        least = min(least, _least_between(rows, between, distance, gaps))
        smallest[distance.array] = np.minimum(smallest[distance.array], gaps)
        if progress is not None:
            progress("checking clearances", (k + 1) / len(distances))
    for name, expected in smallest.items():
        rows.require_same(name, expected, ROUNDING)
    least_logged = float(min(values.min() for values in smallest.values()))
    count = len(distances)
    return (
        Check(
            "no body met a wall or another body",
            count * len(rows.z),
            least_logged,
            "m, smallest",
            tuple(smallest),
        ),
        Check("nor did one between two rows", count * len(rows.steps), least, "m, a lower bound"),
    )


def least_distances(problem: PlanningProblem, z: FloatArray) -> FloatArray:
    """Return the smallest distance of any body to a wall or to a body that it must not meet.

    Args:
        problem: The floor and the team.
        z: Configurations (x, y, theta, q...), shape (T, 3 + n).

    Returns:
        Distances, zero or less where something touches, shape (T,) [m].
    """
    least: FloatArray = np.min([distance.measure(z) for distance in _distances(problem, z)], axis=0)
    return least


def _least_between(rows: Rows, between: Between, distance: _Distance, gaps: FloatArray) -> float:
    """Lower bound of a distance between rows [m]; refuses a log that is too sparse for one above zero."""
    ends = np.minimum(gaps[1:], gaps[:-1])
    bounds = 0.5 * (gaps[1:] + gaps[:-1] - distance.travel(between.speeds * rows.steps[:, None]))
    beside = distance.travel(between.deviations)
    for parts in PARTS:
        coarse = np.flatnonzero(bounds < ENOUGH * ends)
        if not len(coarse):
            break
        weights = np.linspace(0.0, 1.0, parts + 1)[:, None, None]
        z, chord = rows.z[coarse], rows.z[coarse + 1] - rows.z[coarse]
        inner = distance.measure((z + weights * chord).reshape(-1, z.shape[1])).reshape(parts + 1, -1)
        nearest = (0.5 * (inner[1:] + inner[:-1])).min(axis=0) - 0.5 * distance.travel(chord) / parts
        bounds[coarse] = np.maximum(bounds[coarse], nearest - beside[coarse])
    text = f"is {{:.3g}} s after the row before, too long to know that {distance.name} did not touch between"
    rows.require(bounds > 0.0, "times", text, rows.steps, first=1)
    return float(bounds.min(initial=np.inf))


def _distances(problem: PlanningProblem, z: FloatArray) -> list[_Distance]:
    """All distances that must stay positive: of every solid to the walls, and of pairs of solids."""
    tree, floor = problem.tree, problem.workspace
    solids, walls, most = team_solids(tree), floor.boundary, np.abs(z).max(axis=0)
    distances = [
        _Distance(
            f"{solid.name} and a wall",
            "workspace_clearance",
            partial(_wall_gaps, solid, floor, walls),
            _moved_by(solid, len(solid.stages), most),
            moves=True,
        )
        for solid in solids
    ]
    for first, second, *counts in checked_pairs(tree, solids):
        stages = (*_moved_by(first, counts[0], most), *_moved_by(second, counts[1], most))
        name, measure = f"{first.name} and {second.name}", partial(_gaps, first, second)
        distances.append(_Distance(name, "body_clearance", measure, stages, moves=False))
    return distances


def _moved_by(solid: Solid, count: int, most: FloatArray) -> tuple[tuple[TreeJoint, float], ...]:
    stages = solid.stages[:count]
    reach = float(np.hypot(*solid.vertices.T).max()) + solid.radius
    return tuple(zip(stages, levers(reach, stages, most).tolist(), strict=True))


def _shapes(solid: Solid, z: FloatArray) -> NDArray[np.object_]:
    """A solid without its radius in W, for every configuration, shape (T,)."""
    points = points_in_world(solid.vertices, solid.stages, z)
    if points.shape[1] > 2:
        return np.asarray(shapely.polygons(points), dtype=np.object_)
    kind = shapely.linestrings if points.shape[1] == 2 else shapely.points
    return np.asarray(kind(points if points.shape[1] == 2 else points[:, 0]), dtype=np.object_)


def _gaps(first: Solid, second: Solid, z: FloatArray) -> FloatArray:
    """Distance of two solids, zero or less where they touch, shape (T,) [m]."""
    apart: FloatArray = shapely.distance(_shapes(first, z), _shapes(second, z))
    return apart - first.radius - second.radius


def _wall_gaps(solid: Solid, floor: Polygon, walls: BaseGeometry, z: FloatArray) -> FloatArray:
    """Distance of a solid to the walls, negative where its first vertex is outside the floor, (T,) [m]."""
    corner = points_in_world(solid.vertices[:1], solid.stages, z)[:, 0]
    inside = shapely.contains_xy(floor, corner[:, 0], corner[:, 1])
    gaps: FloatArray = np.where(inside, shapely.distance(_shapes(solid, z), walls) - solid.radius, -np.inf)
    return gaps
