"""Shapes to map: rooms and shelves of every kind, and two families that grow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import ConvexHull
from shapely import Point, Polygon, affinity, box

_BODY = ((-0.2, -0.1), (0.0, -0.16), (0.18, -0.12), (0.22, 0.05), (0.1, 0.15), (-0.06, 0.17), (-0.19, 0.08))


@dataclass(frozen=True)
class Domain:
    """A shape and where to go in it.

    Attributes:
        cell: The shape [m].
        goal: A point, or a region of it [m].
    """

    cell: Polygon
    goal: Point | Polygon

    @property
    def vertices(self) -> int:
        """Number of corners."""
        return int(shapely.get_num_coordinates(self.cell)) - 1 - len(self.cell.interiors)


def standard_domains() -> dict[str, Domain]:
    """Domains by name, from a square to cells as planners make them by Minkowski differences."""
    u_corridor = Polygon([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)])
    warehouse, door = _warehouse(), Point(7.3, 5.3)
    return {
        "square": Domain(box(0, 0, 1, 1), Point(0.3, 0.6)),
        "u_corridor": Domain(u_corridor, Point(0.5, 2.5)),
        "warehouse": Domain(warehouse, door),
        "maze": Domain(_maze(14), Point(13.6, 0.5)),
        "minkowski_mitre": Domain(_eroded(warehouse, Polygon(_BODY)), door),
        "minkowski_round": Domain(warehouse.buffer(-0.15, quad_segs=10), door),
        "goal_on_ring": Domain(warehouse, box(7.4, 5.0, 8.0, 5.6)),
    }


def wavy_room(vertices: int) -> Domain:
    """A room whose wall goes in and out five times; no two corners are alike."""
    angle = 2.0 * np.pi * np.arange(vertices) / vertices
    radius = 2.0 + 0.5 * np.cos(5.0 * angle)
    return Domain(Polygon(np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))), Point(1.5, 0.3))


def hall_with_pillars(pillars: int) -> Domain:
    """A hall, eight metres long, with rows of square pillars."""
    columns = 10 if pillars > 12 else 4
    rows = -(-pillars // columns)
    across, along = 8.0 / (columns + 1), 5.0 / (rows + 1)
    side = 0.3 * min(across, along)
    middles = [((k % columns + 1) * across, (k // columns + 1) * along) for k in range(pillars)]
    squares = [box(x - side, y - side, x + side, y + side) for x, y in middles]
    return Domain(_without(box(0, 0, 8, 5), squares), Point(7.9, 2.4))


def _warehouse() -> Polygon:
    """Six shelves, 28 corners."""
    shelves = [
        box(1 + 2.2 * i, 1 + 2.5 * j, 2.4 + 2.2 * i, 1.8 + 2.5 * j) for i in range(3) for j in range(2)
    ]
    return _without(box(0, 0, 8, 6), shelves)


def _maze(corridors: int) -> Polygon:
    """A serpentine with thin walls."""
    walls = [
        box(i - 0.1, -1, i + 0.1, 5.2) if i % 2 else box(i - 0.1, 0.8, i + 0.1, 7)
        for i in range(1, corridors)
    ]
    return _without(box(0, 0, corridors, 6), walls)


def _eroded(room: Polygon, body: Polygon) -> Polygon:
    """Positions of a convex body's origin that keep it in a room of rectangles."""
    mirrored = affinity.scale(body, -1.0, -1.0, origin=(0.0, 0.0))
    offsets = shapely.get_coordinates(mirrored)[:-1]
    walls = []
    for hole in room.interiors:
        points = (shapely.get_coordinates(hole)[:-1, None] + offsets).reshape(-1, 2)
        walls.append(Polygon(points[ConvexHull(points).vertices]))
    x0, y0, x1, y1 = room.bounds
    a0, b0, a1, b1 = body.bounds
    return _without(box(x0 - a0, y0 - b0, x1 - a1, y1 - b1), walls)


def _without(room: Polygon, walls: Sequence[Polygon]) -> Polygon:
    """A room that stays in one piece without its walls."""
    rest = room.difference(shapely.union_all(walls))
    assert isinstance(rest, Polygon)
    return rest
