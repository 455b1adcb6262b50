"""Joins loose ends of lines to lines that they nearly touch: this adds walls and removes none."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Point, STRtree
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.pose import FloatArray


def loose_ends(noded: BaseGeometry) -> FloatArray:
    """Points at which exactly one line ends and no other passes, in order, shape (n, 2) [m].

    The lines, ``noded``, meet at their ends only.
    """
    lines = shapely.get_parts(noded)
    ends = np.vstack([shapely.get_coordinates(shapely.get_point(lines, at)) for at in (0, -1)])
    points, counts = np.unique(ends, axis=0, return_counts=True)
    loose: FloatArray = points[counts == 1]
    return loose


def bridges(noded: BaseGeometry, gap: float) -> list[LineString]:
    """Shortest lines from loose ends to other lines, none longer than the gap [m].

    A loose end goes to the nearest other one if there is one within the gap, otherwise to the nearest line.
    The lines, ``noded``, meet at their ends only.
    """
    ends = loose_ends(noded)
    if not len(ends) or gap <= 0.0:
        return []
    segments = _segments(noded)
    points = [Point(end) for end in ends]
    to_ends, to_segments = STRtree(points), STRtree(segments)
    found = []
    for place, point in enumerate(points):
        near = [other for other in to_ends.query(point, "dwithin", gap).tolist() if other != place]
        if near:
            best = min(near, key=lambda other: (point.distance(points[other]), other))
            found.append(LineString([point, points[best]]))
            continue
        bridge = _to_line(point, [segments[at] for at in sorted(to_segments.query(point, "dwithin", gap))])
        if bridge is not None:
            found.append(bridge)
    return [bridge for bridge in found if bridge.length > 0.0]


def _segments(noded: BaseGeometry) -> list[LineString]:
    """All straight pieces of the lines."""
    pieces = []
    for line in shapely.get_parts(noded):
        coordinates = shapely.get_coordinates(line)
        pieces += [
            LineString(pair) for pair in np.stack([coordinates[:-1], coordinates[1:]], axis=1) if len(pair)
        ]
    return pieces


def _to_line(point: Point, segments: list[LineString]) -> LineString | None:
    """The shortest bridge from a loose end to a line that it does not stand on, a little beyond it."""
    others = [segment for segment in segments if segment.distance(point) > 0.0]
    if not others:
        return None
    nearest = min(others, key=lambda segment: float(segment.distance(point)))
    foot = shapely.get_coordinates(shapely.shortest_line(point, nearest))[1]
    start = shapely.get_coordinates(point)[0]
    return LineString([start, foot + 1e-6 * (foot - start) / np.hypot(*(foot - start))])
