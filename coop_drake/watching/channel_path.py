"""A path through a channel: shortest inside every region, theta moving with it; a sketch, not a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import Point, Polygon

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.planning.cells.graph import Kind
from coop_drake.tree.circles import turns_to
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.search_states import ChannelCell

_INSET = 0.02
"""Distance by which crossings stay inside what two regions share, where that is wide enough [m]."""

_OUTLINE_TOLERANCE = 0.01
"""Distance by which outlines may move when they are simplified [m]: fewer corners, quicker paths."""


@dataclass(frozen=True, eq=False)
class PathPiece:
    """The path through one cell.

    Attributes:
        kind: What is known about the cell.
        positions: Shape (k, 2), k >= 2 [m].
        angles: (theta, q...) along it, circular axes unwrapped piece by piece, shape (k, 1 + n) [rad, m].
    """

    kind: Kind
    positions: FloatArray
    angles: FloatArray


def path_through(
    channel: Sequence[ChannelCell], start: FloatArray, goal: FloatArray, circular: Sequence[bool]
) -> list[PathPiece]:
    """Return a path from start to goal through the cells of a channel; each region meets the next.

    Args:
        channel: The cells.
        start: (x, y, theta, q...), shape (2 + axes,) [m, rad].
        goal: (x, y, theta, q...) at the goal; NaN for joints that are free.
        circular: Which of (theta, q...) are circles.
    """
    pieces: list[PathPiece] = []
    polygons = [_simplified(to_polygon(cell.region.section)) for cell in channel]
    here, angles = np.asarray(start[:2]), np.asarray(start[2:])
    for number, cell in enumerate(channel):
        if number + 1 == len(channel) and not cell.region.holds(goal[:2]):
            there, then = here, angles  # The channel is not complete yet.
        elif number + 1 < len(channel):
            there = _crossing(polygons[number], polygons[number + 1], here)
            then = _shared_angles(cell, channel[number + 1], angles, circular)
        else:
            there, then = np.asarray(goal[:2]), np.where(np.isnan(goal[2:]), angles, goal[2:])
            then = then + turns_to(then.tolist(), angles.tolist(), circular)
        positions = _shortest_inside(polygons[number], here, there)
        steps = np.hypot(*np.diff(positions, axis=0).T)
        fraction = np.concatenate([[0.0], np.cumsum(steps)]) / max(float(steps.sum()), 1e-12)
        fraction[-1] = 1.0
        pieces.append(PathPiece(cell.kind, positions, angles + fraction[:, None] * (then - angles)))
        here, angles = there, then
    return pieces


def _simplified(polygon: Polygon) -> Polygon:
    """Return a polygon with fewer corners, or itself where it would fall apart."""
    simpler = polygon.simplify(_OUTLINE_TOLERANCE)
    return simpler if isinstance(simpler, Polygon) and simpler.is_valid else polygon


def _crossing(first: Polygon, second: Polygon, here: FloatArray) -> FloatArray:
    """Return the point of both polygons nearest to ``here``, a little inside where they overlap widely."""
    shared = shapely.intersection(first, second)
    inner = shared.buffer(-_INSET)
    target = shared if inner.is_empty else inner
    if target.is_empty:
        target = second  # Regions that meet may lose the touch when they are straightened.
    nearest = shapely.shortest_line(target, Point(here))
    return np.asarray(nearest.coords[0])


def _shared_angles(
    cell: ChannelCell, following: ChannelCell, angles: FloatArray, circular: Sequence[bool]
) -> FloatArray:
    """Return the angles in both cells' intervals nearest to ``angles``, circular ones on the nearest turn."""
    result = []
    here, there = ([0.5 * (low + high) for low, high in part.intervals] for part in (cell, following))
    turns = turns_to(here, angles.tolist(), circular)
    turns_there = turns_to(there, (np.array(here) + turns).tolist(), circular)
    for axis, ((a, b), (c, d)) in enumerate(zip(cell.intervals, following.intervals, strict=True)):
        turn_a, turn_c = turns[axis], turns_there[axis]
        low, high = max(a + turn_a, c + turn_c), min(b + turn_a, d + turn_c)
        result.append(float(np.clip(angles[axis], min(low, high), max(low, high))))
    return np.array(result)


def _shortest_inside(polygon: Polygon, here: FloatArray, there: FloatArray) -> FloatArray:
    """Return the shortest path between two points of a polygon, shape (k, 2); straight if there is none."""
    ends = np.array([here, there])
    inside = polygon.buffer(1e-6)
    if inside.covers(shapely.LineString(ends)):
        return ends
    rings = [polygon.exterior, *polygon.interiors]
    nodes = np.concatenate([ends, *[np.asarray(ring.coords)[:-1] for ring in rings]])
    i, j = np.triu_indices(len(nodes), 1)
    lines = np.asarray(shapely.linestrings(np.stack([nodes[i], nodes[j]], axis=1)))
    shapely.prepare(inside)
    seen = shapely.covers(inside, lines)
    lengths = np.maximum(shapely.length(lines[seen]), 1e-9)
    graph = csr_array((lengths, (i[seen], j[seen])), shape=(len(nodes), len(nodes)))
    _, back = dijkstra(graph, directed=False, indices=np.array([0]), return_predecessors=True)
    if back[0, 1] < 0:
        return ends
    visited = [1]
    while visited[-1] != 0:
        visited.append(int(back[0, visited[-1]]))
    return nodes[visited[::-1]]
