"""A linear program that moves a path such that its least distance from the walls becomes larger.

Distances are linear in small moves. With as many walls touched as there are axes, random moves hardly ever
lead away from all of them, and the program's solution does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.convex import following
from coop_drake.geometry.parts import polygon_rings
from coop_drake.planning.questions.floor_near import nearby
from coop_drake.planning.sampling.elastic_band_kernels import clearances
from coop_drake.planning.sampling.near_contacts import Contacts, body_contacts, wall_contacts
from coop_drake.planning.sampling.obstacle_grid import grid_for_team
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

if TYPE_CHECKING:
    from scipy.optimize import LinearConstraint

WIDE_ENOUGH = 0.003
"""A sample with this distance from the walls need not be moved further from them [m]."""

BESIDE = 2
"""So many samples beside those that are moved for their distance are moved, too."""

NEAR = 0.03
"""Distances up to this one are in the program [m]."""

BODY_GAP = 0.001
"""Distance that bodies of the team keep from each other, where they have it [m]."""

MEAN_WEIGHT = 0.3
"""Weight of the mean of all distances beside the least one's 1 [-]: wider places hold longer boxes."""


def with_wider_passages(
    problem: PlanningProblem, path: FloatArray, most: float, spacing: float
) -> FloatArray:
    """Move the samples near walls such that the least distance from the walls grows, to first order.

    The path's ends stay. That the result is free has to be tested.

    Args:
        problem: The question, on whose floor all samples are free.
        path: Samples, close together, circular axes unwrapped, shape (m, 3 + n).
        most: Largest move of a sample in any scaled axis [m].
        spacing: Largest distance of neighbours in any scaled axis that the moves may lead to [m].
    """
    from scipy.optimize import Bounds, milp  # Here: its import takes a tenth of a second.

    tree = problem.tree
    team, scale = tree.arrays, configuration_scale(tree)
    clear = clearances(team, grid_for_team(problem.workspace, team), path, WIDE_ENOUGH + NEAR)
    chosen = np.convolve(clear < WIDE_ENOUGH + most, np.ones(1 + 2 * BESIDE), "same") > 0.0
    chosen[[0, -1]] = False
    samples = path[chosen]
    if not len(samples):
        return path
    walls = wall_contacts(team, samples, _edges_near(problem, samples), NEAR)
    bodies = body_contacts(team, samples, NEAR)
    count, axes = samples.shape
    own, moves = np.arange(count), count * axes
    rows = _Rows(axes, scale)
    rows.add_distances(walls, -walls.distances, (own[walls.rows] + moves, -1.0))
    rows.add_distances(bodies, np.minimum(bodies.distances, BODY_GAP) - bodies.distances)
    rows.add(np.zeros(count), np.inf, (own, moves + own, 1.0), (own, moves + count, -1.0))
    rows.add_neighbours(path * scale, chosen, spacing)
    lower, upper = np.full((count, axes), -most), np.full((count, axes), most)
    lower[:, 3:] = np.clip((tree.joint_lower - samples[:, 3:]) * scale[3:], -most, 0.0)
    upper[:, 3:] = np.clip((tree.joint_upper - samples[:, 3:]) * scale[3:], 0.0, most)
    widest = np.full(count + 1, WIDE_ENOUGH)
    cost = np.concatenate([np.zeros(moves), np.full(count, -MEAN_WEIGHT / count), [-1.0]])
    bounds = Bounds(np.append(lower, -widest), np.append(upper, widest))
    solved = milp(cost, bounds=bounds, constraints=rows.constraint(len(cost)))
    better = path.copy()
    if solved.x is not None:
        better[chosen] += solved.x[:moves].reshape(count, axes) / scale
    return better


def _edges_near(problem: PlanningProblem, samples: FloatArray) -> FloatArray:
    """Edges of the floor that the team may come near, (x0, y0, x1, y1), shape (E, 4) [m]."""
    rings = polygon_rings(nearby(problem.workspace, samples[:, :2], problem.tree.reach))
    return np.concatenate([np.hstack((ring, following(ring))) for ring in rings])


class _Rows:
    """Rows of a sparse matrix with bounds; columns are scaled moves, clearances and the least of these."""

    def __init__(self, axes: int, scale: FloatArray) -> None:
        self._axes, self._scale, self._count = axes, scale, 0
        self._entries: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        self._bounds: list[tuple[FloatArray, FloatArray]] = []

    def add(self, lower: FloatArray, upper: FloatArray | float, *entries: tuple[Any, Any, Any]) -> None:
        """Add rows: bounds, and entries as (row, column, value) with arrays of one shape, or numbers."""
        for entry in entries:
            row, column, value = (part.ravel() for part in np.broadcast_arrays(*entry))
            self._entries.append((row + self._count, column, value))
        self._bounds.append((lower, np.broadcast_to(upper, lower.shape)))
        self._count += len(lower)

    def add_distances(self, contacts: Contacts, lower: FloatArray, *others: tuple[Any, Any]) -> None:
        """Add a row for every contact: how moves change its distance; other entries as (column, value)."""
        row = np.arange(len(lower))
        column = contacts.rows[:, None] * self._axes + np.arange(self._axes)
        changes = (row[:, None], column, contacts.gradients / self._scale)
        self.add(lower, np.inf, changes, *((row, column, value) for column, value in others))

    def add_neighbours(self, path: FloatArray, chosen: NDArray[np.bool_], spacing: float) -> None:
        """Add rows that keep neighbours of a scaled path within the spacing, or as far apart as they are."""
        number = np.cumsum(chosen) - 1
        apart = np.diff(path, axis=0)
        for axis in range(self._axes):
            kept = chosen[1:] | chosen[:-1]
            between = apart[kept, axis]
            row, far = np.arange(len(between)), np.maximum(spacing, np.abs(between))
            entries = [
                (row[own], number[side][kept][own] * self._axes + axis, sign)
                for side, sign in ((slice(1, None), 1.0), (slice(None, -1), -1.0))
                for own in [chosen[side][kept]]
            ]
            self.add(-far - between, far - between, *entries)

    def constraint(self, columns: int) -> LinearConstraint:
        """The rows as a constraint on so many variables."""
        from scipy.optimize import LinearConstraint
        from scipy.sparse import csr_array

        row, column, value = (np.concatenate(parts) for parts in zip(*self._entries, strict=True))
        lower, upper = (np.concatenate(parts) for parts in zip(*self._bounds, strict=True))
        matrix = csr_array((value, (row, column)), shape=(self._count, columns))
        return LinearConstraint(matrix, lower, upper)
