"""Check that no sequence of touching cells leads from the start to the goal.

A motion from start to goal through free configurations only would pass through cells of which each touches
the next, as the cells of all slices together cover the free configurations and are closed sets. If the cells
that such sequences join to the start do not hold the goal, there is no such motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import remainder, tau

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import OverSlice
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.tiling import facet_pairs

__all__ = ["TOUCHING", "check_labels", "check_reachability"]

HELD = 1e-9
"""A slice whose interval misses an angle by no more than this holds it all the same [rad, m]."""

TOUCHING = 1e-6
"""Cells nearer to each other than this touch: covers are computed with rounding, a gap may hide in it [m]."""


def check_reachability(
    slices: Sequence[OverSlice],
    start: Sequence[float],
    goal: Sequence[float | None],
    problem: PlanningProblem,
) -> tuple[Check, Check]:
    """Check the labels of cells, where cells of one slice and of slices that share a facet may touch.

    Facets are enough: where a motion leaves a slice through an edge or a corner, its position lies in cells
    of all slices that meet there, and these slices are joined by facets that contain this edge or corner.

    Args:
        slices: A tiling with its cells.
        start: (theta, kept joints...) of the start.
        goal: (theta, kept joints...) of the goal, None where a joint is free.
        problem: The problem.

    Raises:
        RefusalError: Names the cell and what is wrong with it.
    """
    lower = np.array([part.lower for part in slices])
    upper = np.array([part.upper for part in slices])
    owners = np.repeat(np.arange(len(slices)), [len(part.cells) for part in slices])
    first = np.searchsorted(owners, np.arange(len(slices)))
    polygons = np.array([cell.polygon for part in slices for cell in part.cells], dtype=object)
    names = [f"slices[{k}].cells[{i - first[k]}]" for i, k in enumerate(owners)]
    labels = [cell.reached for part in slices for cell in part.cells]
    own = np.stack((np.arange(len(slices)),) * 2, axis=1)
    pairs = _cell_pairs(np.concatenate((own, facet_pairs(lower, upper))), slices, first)
    touching = pairs[shapely.dwithin(polygons[pairs[:, 0]], polygons[pairs[:, 1]], TOUCHING)]
    at_start, at_goal = (
        {
            i
            for i, k in enumerate(owners)
            if _holds(lower[k], upper[k], angles) and polygons[i].dwithin(Point(pose[:2]), TOUCHING)
        }
        for angles, pose in ((start, problem.start), (goal, problem.goal_pose))
    )
    return Check("cells that touch are both reached or both not", len(touching)), check_labels(
        labels, names, touching, at_start, at_goal
    )


def check_labels(
    labels: Sequence[bool],
    names: Sequence[str],
    touching: NDArray[np.int64],
    at_start: set[int],
    at_goal: set[int],
) -> Check:
    """Compare the labels of cells with what a search from the start over touching cells reaches.

    Args:
        labels: Which cells are called reached.
        names: Names of the cells, for the message.
        touching: Pairs of cells that touch, shape (k, 2).
        at_start: Cells that hold the start.
        at_goal: Cells that hold the goal.

    Raises:
        RefusalError: No cell holds the start, the goal is reached, or a label is wrong.
    """
    if not at_start:
        raise RefusalError("cells", "none of them holds the start")
    neighbours: list[list[int]] = [[] for _ in labels]
    for a, b in touching:
        neighbours[a].append(int(b))
        neighbours[b].append(int(a))
    reached, left = set(at_start), sorted(at_start)
    while left:
        onwards = [k for k in neighbours[left.pop()] if k not in reached]
        reached.update(onwards)
        left += onwards
    for k in sorted(at_goal & reached):
        raise RefusalError(names[k], "holds the goal and touching cells join it to the start")
    for k, label in enumerate(labels):
        if label != (k in reached):
            raise RefusalError(
                f"{names[k]}.reached", f"is {label}; touching cells say {k in reached} from the start on"
            )
    return Check("the start is in reached cells, the goal in none", len(at_start) + len(at_goal))


def _cell_pairs(
    slices: NDArray[np.int64], parts: Sequence[OverSlice], first: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Pairs of cells of pairs of slices, shape (k, 2); within one slice every pair once."""
    pairs = [
        (first[a] + i, first[b] + j)
        for a, b in slices
        for i in range(len(parts[a].cells))
        for j in range(len(parts[b].cells))
        if a != b or i < j
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _holds(lower: FloatArray, upper: FloatArray, angles: Sequence[float | None]) -> bool:
    """Whether intervals hold (theta, q...), theta modulo a turn; any interval holds a free joint, None."""
    for axis, angle in enumerate(angles):
        if angle is None:
            continue
        middle, half = 0.5 * (lower[axis] + upper[axis]), 0.5 * (upper[axis] - lower[axis])
        off = remainder(float(angle - middle), tau) if axis == 0 else float(angle - middle)
        if abs(off) > half + HELD:
            return False
    return True
