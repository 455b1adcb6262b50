"""Slits from the holes of a polygon to its outer ring: without holes a field stands still nowhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

__all__ = ["component_at", "cut_holes"]

WIDTH = 0.04
"""Width of a slit [m]: thin walls would make the map's boundary nearly coincide with itself."""

SPACING = 0.1
"""Distance of the points of a ring from which a slit may start [m]."""


@dataclass(frozen=True)
class _Slit:
    """A straight way from one ring to another: rings are counted from the outer one, 0."""

    rings: tuple[int, int]
    line: LineString
    away: float
    """Distance from the path that must stay open [m]."""


def cut_holes(polygon: Polygon, path: LineString, room: float) -> Polygon:
    """Join every hole to the outer ring, directly or by way of other holes, on the side away from a path.

    A slit is a straight strip a few centimetres wide. Of all straight ways between two rings those that keep
    ``room`` from the path come first, then the short ones far away from it.

    Args:
        polygon: The region [m].
        path: The passage that must stay open, inside the polygon [m].
        room: Distance from the path within which a slit does harm [m].

    Returns:
        What is left around the path's start; the polygon itself if it has no hole. A hole that no straight
        slit can reach without crossing the path stays.
    """
    cut: BaseGeometry = polygon
    for slit in _spanning_slits(polygon, path, room):
        width = min(WIDTH, 0.5 * slit.away)
        cut = cut.difference(_prolonged(slit.line, width).buffer(0.5 * width, cap_style="flat"))
    return component_at(cut, shapely.Point(path.coords[0]))


def component_at(shape: BaseGeometry, point: Point) -> Polygon:
    """The polygon among the parts of a shape that holds a point, an empty one if none does."""
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon) and part.contains(point)]
    return parts[0] if parts else Polygon()


def _spanning_slits(polygon: Polygon, path: LineString, room: float) -> list[_Slit]:
    """The fewest and best slits that join all rings: a spanning tree of rings, built greedily."""

    def rank(slit: _Slit) -> tuple[bool, float]:
        return slit.away < room, slit.line.length - min(slit.away, 3.0 * room)

    group = list(range(1 + len(polygon.interiors)))
    chosen = []
    for slit in sorted(_candidates(polygon, path), key=rank):
        first, second = (group[ring] for ring in slit.rings)
        if first != second:
            group = [first if label == second else label for label in group]
            chosen.append(slit)
    return chosen


def _candidates(polygon: Polygon, path: LineString) -> list[_Slit]:
    """Shortest ways from points of each hole to each other ring that cross neither walls nor the path."""
    rings = [polygon.exterior, *polygon.interiors]
    inside = polygon.buffer(1e-7)
    slits = []
    for k, hole in enumerate(rings[1:], start=1):
        corners = shapely.get_coordinates(shapely.segmentize(hole, SPACING))
        points = shapely.points(0.5 * (corners[:-1] + corners[1:]))
        for m, other in enumerate(rings):
            if m == k:
                continue
            for line in shapely.shortest_line(points, other):
                away = float(path.distance(line))
                if away > 0.0 and line.length > 0.0 and inside.covers(line):
                    slits.append(_Slit((k, m), line, away))
    return slits


def _prolonged(line: LineString, reach: float) -> LineString:
    """The line, longer at both ends, so that a strip along it breaks through both rings."""
    start, end = shapely.get_coordinates(line)
    step = reach * (end - start) / np.linalg.norm(end - start)
    return LineString([start - step, end + step])
