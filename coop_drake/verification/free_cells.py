"""Whether a cell lies in free space: outer sweeps against walls and among bodies, as sharp as need be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.solids import Solid
from coop_drake.verification.walls import Walls, wall_sums

__all__ = ["check_apart", "check_clear_of_walls"]

TOLERANCES = (1e-3, 3e-5, 2e-7)
"""How far outer sweeps may stand out, coarse first: most walls are far away [m]."""

HALVINGS = 8
"""A slice whose sweeps are not sharp enough is halved so often before it is refused."""

Test = Callable[[FloatArray, FloatArray, float], str]


def check_clear_of_walls(
    cell: Polygon,
    lower: FloatArray,
    upper: FloatArray,
    solid: Solid,
    walls: Walls,
    where: str,
    room: float = 0.0,
) -> int:
    """Make sure that a solid stays inside the floor at every position of a cell and all angles of its slice.

    A connected solid lies inside a floor if it meets none of its edges and one of its points is inside; as
    the cell is connected too, the point needs to be looked at for one position only.

    Args:
        cell: Positions p_WL [m].
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        solid: The solid.
        walls: The floor and its edges.
        where: Name of the cell, for the message.
        room: Clearance to keep from the walls [m].

    Returns:
        How many sums of an edge with a sweep were tested.

    Raises:
        RefusalError: Names the cell, the body and the wall.
    """
    tested, radius = 0, solid.radius + room

    def meets(low: FloatArray, high: FloatArray, tolerance: float) -> str:
        nonlocal tested
        ring = outer_sweep(solid, low, high, tolerance)
        reach = np.concatenate((ring.min(axis=0), ring.max(axis=0)))
        reach += radius * np.array([-1.0, -1.0, 1.0, 1.0])
        near = walls.near(np.array(cell.bounds) + reach)
        starts, ends = walls.starts[near], walls.ends[near]
        sums = wall_sums(starts, ends, ring)
        tested += len(sums)
        met = shapely.dwithin(cell, sums, radius)
        return "" if not met.any() else _wall(starts[met][0], ends[met][0])

    wall = _unresolved(meets, lower, upper, solid)
    if wall:
        raise RefusalError(where, f"{solid.name} may touch {wall}, or come nearer than {room} m")
    middle = 0.5 * (lower + upper)
    point = np.array(cell.representative_point().coords[0]) + outer_sweep(solid, middle, middle, 1.0)[0]
    if not walls.floor.contains(Point(point)):
        raise RefusalError(where, f"{solid.name} stands outside the floor, at {_text(point)}")
    return tested


def check_apart(
    lower: FloatArray, upper: FloatArray, pair: tuple[Solid, Solid, int, int], where: str
) -> float:
    """Make sure that two solids never touch at any angles of a slice.

    Args:
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        pair: The solids and their stages up to the component that both hang from.
        where: Name of the cell, for the message.

    Returns:
        A distance that they keep, not the largest [m].

    Raises:
        RefusalError: Names the cell and the bodies.
    """
    first, second, *stages = pair
    least = np.inf

    def meets(low: FloatArray, high: FloatArray, tolerance: float) -> str:
        nonlocal least
        one, other = (
            shapely.convex_hull(shapely.multipoints(outer_sweep(solid, low, high, tolerance, count)))
            for solid, count in zip((first, second), stages, strict=True)
        )
        gap = float(shapely.distance(one, other)) - first.radius - second.radius
        if gap > 0.0:
            least = min(least, gap)
        return "" if gap > 0.0 else second.name

    name = _unresolved(meets, lower, upper, first, second, stages=stages)
    if name:
        raise RefusalError(where, f"{first.name} may touch {name}")
    return float(least)


def _unresolved(
    meets: Test, lower: FloatArray, upper: FloatArray, *solids: Solid, stages: list[int] | None = None
) -> str:
    """What the sweeps meet even when they are sharp and the slice is halved; empty where it is nothing."""
    counts = stages if stages is not None else [len(solid.stages) for solid in solids]
    axes = sorted(
        {stage.axis for solid, count in zip(solids, counts, strict=True) for stage in solid.stages[:count]}
    )
    left = [(lower, upper, 0)]
    while left:
        low, high, depth = left.pop()
        found = ""
        for tolerance in TOLERANCES:
            found = meets(low, high, tolerance)
            if not found:
                break
        if not found:
            continue
        middle = 0.5 * (low + high)
        if depth == HALVINGS or meets(middle, middle, TOLERANCES[-1]):
            return found
        axis = max(axes, key=lambda axis: (high[axis] - low[axis], -axis))
        left += [(low, _with(high, axis, middle[axis]), depth + 1)]
        left += [(_with(low, axis, middle[axis]), high, depth + 1)]
    return ""


def _with(ends: FloatArray, axis: int, value: float) -> FloatArray:
    changed = ends.copy()
    changed[axis] = value
    return changed


def _wall(start: FloatArray, end: FloatArray) -> str:
    return f"the wall from {_text(start)} to {_text(end)}"


def _text(point: FloatArray) -> str:
    return f"({point[0]:.4f}, {point[1]:.4f})"
