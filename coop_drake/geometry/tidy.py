"""Tidy cells: the way through a safe region without bays, cusps, slivers and idle vertices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.geometry.polygons import component_at
from coop_drake.geometry.passage import PassageFinder
from coop_drake.geometry.simplify import simplify_inward
from coop_drake.tree.pose import FloatArray

GUARD = 1e-6
"""A tidy cell keeps this distance from the safe region's boundary, so that rounding never leaves it [m]."""

SLACK = 1e-7
"""How far vertices may stand out of the rest when they are left out, well within the guard [m]."""

DEEPEST_CUT = 0.02
"""Simplification never cuts deeper than this [m]."""

CUT_PER_CLEARANCE = 0.2
"""Simplification never cuts deeper than this fraction of the passage's clearance, either [-]."""

MITRE_LIMIT = 1.9
"""Longest mitre over the radius [-]: corners sharper than about 63 degrees are cut off. Below 2, so that a
passage between two opposite corners stays open."""

CORRIDOR = 2.0
"""The corridor is this many clearances wide to either side of the passage [-]."""

STRIDE, MOST_STRIDES = 0.5, 100
"""Discs of the corridor follow one another by this part of the passage's clearance [-], but there are not
more than about this many."""


def tidy_cell(safe: Polygon, points: Sequence[FloatArray]) -> Polygon:
    """Make a cell Q that can be mapped of a safe region S: opening(S, b/2), cut to a corridor, simplified.

    b is the clearance of the widest passage through the given points. The opening and the corridor keep the
    passage's clearance, and simplification takes off at most a fifth of it. The corridor leaves out bays that
    the passage goes by, and most holes: a field that is harmonic in it follows the passage more closely. The
    opening as a whole is taken where it has fewer vertices and no more holes, and S itself where rounding
    spoils both.

    Args:
        safe: S, with holes or without [m].
        points: Points that Q must hold, in the order in which they are passed: entry, target; each (2,) [m].

    Returns:
        Q, inside S (checked exactly).

    Raises:
        GeometryError: If S does not join the points.
    """
    region = component_at(safe.buffer(-GUARD, join_style="mitre"), Point(points[0]))
    if region.is_empty:
        raise GeometryError(f"the safe region holds no path through {Point(points[0]).wkt}")
    finder = PassageFinder(region)
    passages = [finder.find(start, end) for start, end in pairwise(points)]
    path = LineString([point for passage in passages for point in passage.path.coords])
    clearance = min(passage.clearance for passage in passages)
    ends = [Point(point) for point in points]

    def serves(cell: Polygon) -> bool:
        inside = not cell.is_empty and cell.is_valid and safe.covers(cell)
        return inside and all(map(cell.contains, ends)) and bool(cell.covers(path))

    found = filter(serves, _tidied(region, path, clearance))
    return min(found, key=lambda cell: (len(cell.interiors), shapely.get_num_coordinates(cell)), default=region)


def _tidied(region: Polygon, path: LineString, clearance: float) -> Iterator[Polygon]:
    """The opening of a region around a path, and the part of it in the corridor, both simplified."""
    start, depth = Point(path.coords[0]), max(min(DEEPEST_CUT, CUT_PER_CLEARANCE * clearance), SLACK)
    eroded = region.buffer(-0.5 * clearance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    dilated = eroded.buffer(0.5 * clearance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    # GEOS may give a mitred boundary that crosses itself, which it then refuses to intersect.
    opened = component_at(shapely.make_valid(dilated).intersection(region), start)
    stride = max(STRIDE * clearance, path.length / MOST_STRIDES)
    places = shapely.points(shapely.get_coordinates(shapely.segmentize(path, stride)))
    room = BoundaryDistance(region).batch(shapely.get_coordinates(places))
    discs = shapely.buffer(places, CORRIDOR * room, quad_segs=4)
    links = shapely.convex_hull([shapely.MultiPolygon([*pair]) for pair in pairwise(discs)])
    for shape in (opened, component_at(shapely.union_all(links).intersection(opened), start)):
        if not shape.is_empty:
            # What the opening leaves out in the middle of a region without holes is safe all the same.
            whole = shape if region.interiors else Polygon(shape.exterior)
            yield simplify_inward(whole, depth, SLACK)
