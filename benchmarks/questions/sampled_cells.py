"""Distances from walls and between bodies at configurations sampled in the cells of a plan."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers import Plan, PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.runs.clearances import least_distances

_CORNERS, _BOUNDARY = 0.4, 0.3
"""Fractions of positions at corners and along the boundary of a cell, where bodies are nearest to walls."""

_ENDS = 0.7
"""Fraction of angles and joint values at the ends of their intervals."""


def sampled_margin(problem: PlanningProblem, plan: Plan, samples: int, seed: int) -> float:
    """Return the smallest distance of any body to a wall or another body in the cells of a plan [m].

    A cell states that all of its positions are free with all of its angles, so that any configuration with
    zero or less refutes the plan.

    Args:
        problem: The floor and the team.
        plan: The plan.
        samples: Configurations for each cell.
        seed: Of the samples.
    """
    random = np.random.default_rng(seed)
    drawn = []
    for cell in plan.cells:
        shares = random.random((samples, len(cell.lower)))
        shares = np.where(random.random(shares.shape) < _ENDS, np.rint(shares), shares)
        angles = cell.lower + shares * (cell.upper - cell.lower)
        drawn.append(np.column_stack((_positions(random, cell.tidied, samples), angles)))
    return float(least_distances(problem, np.concatenate(drawn)).min())


def _positions(random: np.random.Generator, region: Polygon, count: int) -> FloatArray:
    """Corners, points along the boundary and points inside, shape (count, 2) [m]."""
    all_corners = shapely.get_coordinates(region)
    corners = random.choice(all_corners, round(_CORNERS * count))
    boundary = shapely.boundary(region)
    along = random.random(round(_BOUNDARY * count))
    points = shapely.get_coordinates(shapely.line_interpolate_point(boundary, along, normalized=True))
    left = count - len(corners) - len(points)
    low, high = np.reshape(region.bounds, (2, 2))
    inside = random.uniform(low, high, (8 * left, 2))
    inside = inside[shapely.contains_xy(region, inside)][:left]
    # A thin region may hold few of the points drawn in its bounds; its corners make up for them.
    missing = random.choice(all_corners, left - len(inside))
    return np.concatenate((corners, points, inside, missing))
