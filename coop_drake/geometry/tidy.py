"""Tidy cells: inside a safe region, simply connected, without cusps, slivers and idle vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import shapely
from shapely import LineString, Point, Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.corridor import corridor_around
from coop_drake.geometry.parts import component_at
from coop_drake.geometry.passage import PassageFinder
from coop_drake.geometry.simplify import simplify_inward
from coop_drake.geometry.slits import cut_holes
from coop_drake.tree.pose import FloatArray

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
