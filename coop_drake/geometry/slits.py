"""Slits from the holes of a polygon to its outer ring: without holes a field stands still nowhere."""

from __future__ import annotations

from heapq import heapify, heappop, heappush
from math import inf

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from coop_drake.geometry.edge_pieces import IndexArray
from coop_drake.geometry.parts import component_at
from coop_drake.geometry.triangles import Triangles, triangulate
from coop_drake.tree.pose import FloatArray

WIDTH = 0.04
"""Greatest width of a slit [m]: thin walls would make the map's boundary nearly coincide with itself."""

WIDTH_PER_LENGTH = 0.2
"""Greatest width of a slit over its length [-]."""

NEAR = 1.0
"""Greatest distance by which an end of a slit is moved so that it meets its ring at a right angle, over the
slit's length [-]."""

SQUARED_ENDS = (0, 1, 0, 1)
"""Ends of a slit that stay in place, one after the other, while the other end is moved."""

BREAKS = 12
"""How often the depth of a slit inside a wall is halved so that it does not pass through a thin wall."""


def cut_holes(polygon: Polygon, path: BaseGeometry, clearance: float) -> Polygon:
    """Join every hole to the outer ring, directly or through other holes, by slits off the path.

    See `slits_of`. A slit is a straight strip a few centimetres wide.

    Args:
        polygon: The region [m].
        path: What must stay open, inside the polygon: a passage that ends at the goal, the goal, or both [m].
        clearance: Slits are kept this far from the path where possible [m].

    Returns:
        What is left around the path; the polygon itself if it has no hole. A hole that no straight
        slit can reach without crossing the path stays.
    """
    strips = [
        _strip(slit, polygon, float(path.distance(slit))) for slit in slits_of(polygon, path, clearance)
    ]
    cut = polygon.difference(shapely.union_all(strips))
    return component_at(cut, path.representative_point())


def slits_of(polygon: Polygon, path: BaseGeometry, clearance: float) -> list[LineString]:
    """Straight segments between rings that make a region simply connected and lengthen no way to the path.

    On a triangulation whose vertices all lie on rings, the quickest ways from everywhere to the path cross
    some of the diagonals. The other diagonals join the rings in a tree, for a spanning tree of the triangles
    and one of the rings share no diagonal, so no way becomes longer. Diagonals nearer to the path than
    ``clearance`` are replaced by others where possible; those that cross it are never taken.

    Args:
        polygon: The region [m].
        path: What must stay open, as for `cut_holes` [m].
        clearance: Slits are kept this far from the path where possible; half the width below which a passage
            slows down [m].
    """
    if not polygon.interiors:
        return []
    mesh = triangulate(polygon)
    arrival, entrance = _quickest_ways(mesh, path, clearance)
    lines = np.asarray(shapely.linestrings(mesh.vertices[mesh.diagonals]))
    away = np.asarray(shapely.distance(lines, path))
    crossed = np.zeros(len(away), dtype=np.bool_)
    crossed[entrance[entrance >= 0]] = True
    latest = arrival[mesh.neighbours].max(axis=1)
    length = np.asarray(shapely.length(lines))
    # Diagonals that no quickest way crosses come first, then those crossed earliest on the way to the path.
    order = np.lexsort((length, np.where(crossed, -latest, 0.0), crossed, away < clearance))
    group = np.arange(1 + len(polygon.interiors))
    chosen = []
    for k in order:
        first, second = group[mesh.ring[mesh.diagonals[k]]]
        if first != second and away[k] > 0.0:
            group[group == first] = second
            chosen.append(k)
    return _squared(polygon, path, list(lines[chosen]), mesh.ring[mesh.diagonals[chosen]])


def _squared(
    polygon: Polygon, path: BaseGeometry, lines: list[LineString], rings: IndexArray
) -> list[LineString]:
    """Move one end of each slit to where it meets its ring at a right angle, where that is near and free."""
    walls = [polygon.exterior, *polygon.interiors]
    shapely.prepare(polygon)
    for k, line in enumerate(lines):
        others = shapely.union_all(lines[:k] + lines[k + 1 :])
        for end in SQUARED_ENDS:
            short = shapely.shortest_line(Point(lines[k].coords[end]), walls[rings[k][1 - end]])
            short = short if end == 0 else short.reverse()
            if (
                0.0 < short.length < lines[k].length
                and line.hausdorff_distance(short) <= NEAR * line.length
                and path.distance(short) >= 0.5 * path.distance(line)
                and not others.intersects(short)
                and shapely.contains_properly(polygon, substring(short, 0.01, 0.99, normalized=True))
            ):
                lines[k] = short
    return lines


def _quickest_ways(mesh: Triangles, path: BaseGeometry, clearance: float) -> tuple[FloatArray, IndexArray]:
    """When each triangle reaches the path's end, and through which diagonal it is left (-1 on the path)."""
    centres = mesh.vertices[mesh.corners].mean(axis=1)
    ends = mesh.vertices[mesh.diagonals]
    middles, widths = ends.mean(axis=1), np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    walked = np.linalg.norm(centres[mesh.neighbours] - middles[:, None], axis=2).sum(axis=1)
    cost = walked * (1.0 + 2.0 * clearance / widths)
    around: list[list[tuple[int, int]]] = [[] for _ in centres]
    for k, (a, b) in enumerate(mesh.neighbours.tolist()):
        around[a].append((b, k))
        around[b].append((a, k))
    met = np.flatnonzero(shapely.intersects(shapely.polygons(mesh.vertices[mesh.corners]), path))
    arrival, entrance = np.full(len(centres), inf), np.full(len(centres), -1)
    arrival[met] = [_left_on(path, Point(centres[t])) for t in met]
    queue = [(float(arrival[t]), int(t)) for t in met]
    heapify(queue)
    while queue:
        time, here = heappop(queue)
        if time > arrival[here]:
            continue
        for there, k in around[here]:
            if time + cost[k] < arrival[there] and not (arrival[there] < inf and entrance[there] < 0):
                arrival[there], entrance[there] = time + cost[k], k
                heappush(queue, (float(arrival[there]), there))
    return arrival, entrance


def _left_on(path: BaseGeometry, point: Point) -> float:
    """Length of a path from its point nearest to another one to its end; zero for what is no path [m]."""
    lines = [p for p in shapely.get_parts(path) if isinstance(p, LineString) and p.length > 0.0]
    return float(lines[0].length - lines[0].project(point)) if lines else 0.0


def _strip(slit: LineString, polygon: Polygon, away: float) -> Polygon:
    """A strip along a slit that breaks through the rings at both ends, but not out of a thin wall again."""
    width = min(WIDTH, WIDTH_PER_LENGTH * slit.length, 0.5 * away)
    start, end = shapely.get_coordinates(slit)
    step = width * (end - start) / slit.length
    for _ in range(BREAKS):
        strip = LineString([start - step, end + step]).buffer(0.5 * width, cap_style="flat")
        if shapely.get_num_geometries(strip.intersection(polygon)) == 1:
            break
        step = 0.5 * step
    return strip
