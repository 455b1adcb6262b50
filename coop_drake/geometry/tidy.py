"""Tidy cells: inside a safe region, simply connected, without cusps, slivers and idle vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import pairwise
from math import inf, pi, sqrt

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import BoundaryDistance, signed_distance
from coop_drake.geometry.edge_pieces import IndexArray
from coop_drake.geometry.parts import component_at
from coop_drake.geometry.passage import PassageFinder
from coop_drake.geometry.simplify import simplify_inward
from coop_drake.geometry.triangles import Triangles, triangulate
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

# Slits from the holes of a polygon to its outer ring: without holes a field stands still nowhere.

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


# The corridor around a passage: a region without the bays that the passage only goes by.

STRIDE = 0.5
"""Distance of the discs along the path, over the clearance there [-]."""

SHORTEST_STRIDE = 5e-3
"""The stride is at least this where the clearance is small [m]."""

VERTICES = 16
"""Vertices of a disc."""

_ANGLES = np.arange(VERTICES) * (2.0 * pi / VERTICES)
CIRCLE = np.stack((np.cos(_ANGLES), np.sin(_ANGLES)), axis=1)
"""Vertices of a unit disc about the origin, shape (VERTICES, 2) [-]."""


def corridor_around(polygon: Polygon, path: LineString, widening: float) -> Polygon:
    """Keep what lies within ``widening`` times the clearance of each point of a path.

    A field that is harmonic in the corridor follows the path more closely than one that fills every bay, and
    the path keeps its clearance: its distance to the corridor's boundary is its distance to the region's.

    Args:
        polygon: The region [m].
        path: A path inside it [m].
        widening: How many clearances wide the corridor is to either side, above 1 [-].

    Returns:
        The part of the corridor that holds the path's start.
    """
    edges = BoundaryDistance(polygon).edges
    centres = _stops(edges, shapely.get_coordinates(path))
    rings = centres[:, None, :2] + widening * centres[:, None, 2:] * CIRCLE
    pairs = np.concatenate((rings[:-1], rings[1:]), axis=1) if len(rings) > 1 else rings
    links = shapely.convex_hull(shapely.multipoints(pairs))
    return component_at(shapely.union_all(links).intersection(polygon), Point(path.coords[0]))


@compiled
def _stops(edges: FloatArray, path: FloatArray) -> FloatArray:
    """Places along a path, both ends among them, with their clearances (x, y, d), shape (k, 3)."""
    stops = []
    left = 0.0
    for k in range(len(path) - 1):
        x, y = path[k, 0], path[k, 1]
        dx, dy = path[k + 1, 0] - x, path[k + 1, 1] - y
        length = sqrt(dx * dx + dy * dy)
        while left < length:
            px, py = x + left / length * dx, y + left / length * dy
            clearance = signed_distance(edges, px, py)
            stops.append((px, py, clearance))
            left += max(STRIDE * clearance, SHORTEST_STRIDE)
        left -= length
    x, y = path[-1, 0], path[-1, 1]
    stops.append((x, y, signed_distance(edges, x, y)))
    return np.array(stops)


GUARD = 1e-6
"""A tidy cell keeps this distance from the safe region's boundary, so that rounding never leaves it [m]."""

SLACK = 1e-7
"""How far vertices may stand out of the rest when they are left out, well within the guard [m]."""

DEEPEST_CUT = 0.02
"""Simplification never cuts deeper than this [m]."""

CUT_PER_CLEARANCE = 0.2
"""Simplification never cuts deeper than this fraction of the passage's clearance, either [-]."""

CLEARANCE_KEPT = 0.8
"""Fraction of the passage's clearance that a tidied cell must keep; else a weaker tidying is tried [-]."""

MITRE_LIMIT = 1.9
"""Longest mitre over the radius [-]: corners sharper than about 63 degrees are cut off. Below 2, so that a
passage between two opposite corners stays open."""

CORRIDOR = 2.0
"""Bays farther from the passage than this many clearances are left out where that saves vertices [-]."""

STRENGTHS = (1.0, 0.5, 0.2, 0.0)
"""Fractions of the full opening and simplification, tried in this order [-]."""


@dataclass(frozen=True)
class _Route:
    """The path through a cell that tidying must keep, and its clearance [m]."""

    points: tuple[Point, ...]
    path: LineString
    clearance: float


def tidy_cell(safe: Polygon, points: Sequence[FloatArray]) -> Polygon:
    """Make a cell Q that can be mapped of a safe region S: opening(S, b/2) within S, cut open, simplified.

    b is the clearance of the widest passage through the given points. Where full tidying would lose a point
    or a fifth of b, weaker ones are tried; the last one only joins the holes to the outer ring.

    Args:
        safe: S, with holes or without [m].
        points: Points that Q must hold, in the order in which they are passed: entry, target; each (2,) [m].

    Returns:
        Q, inside S (checked exactly), simply connected where straight slits can make it so.

    Raises:
        GeometryError: If S does not join the points.
    """
    region = component_at(safe.buffer(-GUARD, join_style="mitre"), Point(points[0]))
    if region.is_empty:
        raise GeometryError(f"the safe region holds no path through {Point(points[0]).wkt}")
    route = _route(region, points)
    opened = region
    for _ in region.interiors:
        if not opened.interiors:
            break
        opened = cut_holes(opened, route.path, route.clearance) or region
    for strength in STRENGTHS:
        cell = _tidied(opened, route, strength)
        for candidate in (_without_bays(cell, route), cell):
            if candidate is not None and _serves(candidate, safe, points, route):
                return candidate
    return opened


def _without_bays(cell: Polygon, route: _Route) -> Polygon | None:
    """The corridor around the passage in a cell, None if it has no fewer vertices."""
    if not cell.covers(route.path):
        return None
    corridor = corridor_around(cell, route.path, CORRIDOR)
    corridor = _simplified(Polygon(corridor.exterior), route, 1.0)
    fewer = shapely.get_num_coordinates(corridor) < shapely.get_num_coordinates(cell)
    return corridor if fewer else None


def _route(region: Polygon, points: Sequence[FloatArray]) -> _Route:
    finder = PassageFinder(region)
    passages = [finder.find(start, end) for start, end in pairwise(points)] if len(points) > 1 else []
    if not passages:
        here = Point(points[0])
        return _Route((here,), LineString([here, here]), BoundaryDistance(region)(points[0]))
    coordinates = [point for passage in passages for point in passage.path.coords]
    return _Route(
        tuple(Point(p) for p in points),
        LineString(coordinates),
        min(passage.clearance for passage in passages),
    )


def _tidied(region: Polygon, route: _Route, strength: float) -> Polygon:
    """Opening, then simplification, both with mitred corners so that straight walls stay as they are."""
    radius = 0.5 * strength * route.clearance
    shape = region
    if radius > 0.0:
        eroded = region.buffer(-radius, join_style="mitre", mitre_limit=MITRE_LIMIT)
        dilated = eroded.buffer(radius, join_style="mitre", mitre_limit=MITRE_LIMIT)
        # GEOS may give a mitred boundary that crosses itself, which it then refuses to intersect.
        shape = component_at(shapely.make_valid(dilated).intersection(region), route.points[0])
    if not region.interiors:
        # What the opening leaves out in the middle of a region without holes is safe all the same.
        shape = Polygon(shape.exterior)
    return _simplified(shape, route, strength)


def _simplified(shape: Polygon, route: _Route, strength: float) -> Polygon:
    depth = strength * min(DEEPEST_CUT, CUT_PER_CLEARANCE * route.clearance)
    return simplify_inward(shape, max(depth, SLACK), SLACK) if not shape.is_empty else shape


def _serves(cell: Polygon, safe: Polygon, points: Sequence[FloatArray], route: _Route) -> bool:
    """Whether a cell lies inside the safe region and still joins all points widely enough."""
    if cell.is_empty or not cell.is_valid or not safe.covers(cell):
        return False
    if not all(cell.contains(Point(point)) for point in points):
        return False
    least, path = CLEARANCE_KEPT * route.clearance, shapely.get_coordinates(route.path)
    # The path through the safe region is a passage of the cell, too, unless tidying came near it.
    if BoundaryDistance(cell).along(path[:-1], path[1:]).min() >= least:
        return True
    finder = PassageFinder(cell)
    return all(finder.find(start, end).clearance >= least for start, end in pairwise(points))
