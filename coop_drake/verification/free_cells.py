"""Check that a cell lies in free space: outer sweeps of all bodies keep clear of walls and of each other.

An outer sweep of a body is a polygon that holds the body at every angle of the slice, in directions of W
about the object's origin. The cell is free if at none of its positions the polygon meets a wall or that of
another body.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.floor_edges import FloorEdges, edge_obstacles
from coop_drake.verification.halving import first_failure
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.solids import Solid

__all__ = ["check_apart", "check_clear_of_walls"]

TOLERANCES = (1e-3, 3e-5, 2e-7)
"""How much too large outer sweeps may be, tried in this order: most walls are far away [m]."""

HALVINGS = 8
"""How many times a slice is halved where even its sharpest sweep meets something [-]."""


def check_clear_of_walls(
    cell: Polygon,
    lower: FloatArray,
    upper: FloatArray,
    solid: Solid,
    edges: FloorEdges,
    where: str,
    clearance: float = 0.0,
) -> int:
    """Check that a solid lies inside the floor at every position of a cell and all angles of its slice.

    A connected solid lies inside the floor if it meets none of its edges and one of its points is inside. As
    the cell is connected too, the point needs to be inside at one position and one angle only.

    Args:
        cell: Positions p_WL [m].
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        solid: The solid.
        edges: The floor and those of its edges from which to keep clear.
        where: Name of the cell, for the message.
        clearance: Distance to keep from the edges [m].

    Returns:
        How many times an edge was tested against a sweep.

    Raises:
        RefusalError: Names the cell, the body and the wall.
    """
    tested, radius = 0, solid.radius + clearance

    def met(low: FloatArray, high: FloatArray, tolerance: float) -> str:
        nonlocal tested
        ring = outer_sweep(solid, low, high, tolerance)
        reach = np.concatenate((ring.min(axis=0) - radius, ring.max(axis=0) + radius))
        near = edges.near(np.array(cell.bounds) + reach)
        starts, ends = edges.starts[near], edges.ends[near]
        hit = shapely.dwithin(cell, edge_obstacles(starts, ends, ring), radius)
        tested += len(starts)
        return f"the wall from {_text(starts[hit][0])} to {_text(ends[hit][0])}" if hit.any() else ""

    axes = {stage.axis for stage in solid.stages}
    wall = first_failure(_sharpest(met), lower, upper, axes, HALVINGS)
    if wall:
        raise RefusalError(where, f"{solid.name} may touch {wall}, or come nearer than {clearance} m")
    middle = 0.5 * (lower + upper)
    point = np.array(cell.representative_point().coords[0]) + outer_sweep(solid, middle, middle, 1.0)[0]
    if not edges.floor.contains(Point(point)):
        raise RefusalError(where, f"{solid.name} stands outside the floor, at {_text(point)}")
    return tested


def check_apart(
    lower: FloatArray, upper: FloatArray, pair: tuple[Solid, Solid, int, int], where: str
) -> float:
    """Check that two solids never touch at any angles of a slice.

    Args:
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        pair: The solids, and how many stages of each lead to the component that carries both.
        where: Name of the cell, for the message.

    Returns:
        A lower bound of their distance [m].

    Raises:
        RefusalError: Names the cell and the bodies.
    """
    first, second, *counts = pair
    moved = list(zip((first, second), counts, strict=True))
    least = np.inf

    def met(low: FloatArray, high: FloatArray, tolerance: float) -> str:
        nonlocal least
        one, other = (
            shapely.convex_hull(shapely.multipoints(outer_sweep(solid, low, high, tolerance, count)))
            for solid, count in moved
        )
        gap = float(shapely.distance(one, other)) - first.radius - second.radius
        if gap > 0.0:
            least = min(least, gap)
        return "" if gap > 0.0 else second.name

    axes = {stage.axis for solid, count in moved for stage in solid.stages[:count]}
    name = first_failure(_sharpest(met), lower, upper, axes, HALVINGS)
    if name:
        raise RefusalError(where, f"{first.name} may touch {name}")
    return float(least)


def _sharpest(
    met: Callable[[FloatArray, FloatArray, float], str],
) -> Callable[[FloatArray, FloatArray], str]:
    """What the sharpest sweeps of a slice meet, after coarser ones met something as well."""

    def failure(low: FloatArray, high: FloatArray) -> str:
        found = ""
        for tolerance in TOLERANCES:
            found = met(low, high, tolerance)
            if not found:
                break
        return found

    return failure


def _text(point: FloatArray) -> str:
    return f"({point[0]:.4f}, {point[1]:.4f})"
