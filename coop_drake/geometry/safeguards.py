"""Replacements for results of geometry libraries that fail; they never prove a position free or blocked."""

from __future__ import annotations

from collections.abc import Sequence

import shapely
from manifold3d import CrossSection
from shapely import MultiPolygon, Polygon
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.minkowski import common
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.tree.pose import FloatArray

_FAILURES = (RuntimeError, ValueError, ArithmeticError)
_ROUNDING = 1e-6
"""Areas that should be equal may differ by this fraction [-]: more than rounding, less than a failure."""


def shared(first: CrossSection, second: CrossSection, *, over: bool) -> CrossSection:
    """Intersection of two regions; where clipping fails, the smaller over-region or the empty under-region.

    Of an over-region what is left out is called blocked, of another one what is kept is called free.
    """
    smaller = min(first, second, key=CrossSection.area)
    try:
        found = common(first, second)
        if found.area() <= (1.0 + _ROUNDING) * smaller.area():
            return found
    except _FAILURES:
        pass
    return smaller if over else CrossSection()


def components(section: CrossSection, *, over: bool) -> list[CrossSection]:
    """Connected parts of a region; if decomposing fails, the whole region if ``over``, otherwise none."""
    if section.is_empty():
        return []
    try:
        parts = [part for part in section.decompose() if not part.is_empty()]
        if abs(sum(part.area() for part in parts) - section.area()) <= _ROUNDING * section.area():
            return parts
    except _FAILURES:
        pass
    return [section] if over else []


def meet(first: CrossSection, second: CrossSection, *, otherwise: bool) -> bool:
    """Whether two regions share more than their boundary; ``otherwise`` where clipping fails."""
    try:
        return not common(first, second).is_empty()
    except _FAILURES:
        return otherwise


def checked_buffer(workspace: Polygon | MultiPolygon, distance: float) -> Polygon | MultiPolygon:
    """W, grown or shrunk where the distance is negative [m]; if that fails, its bounding box, or nothing."""
    try:
        result = workspace.buffer(distance, join_style="mitre")
        nested = result.covers(workspace) if distance > 0.0 else workspace.covers(result)
    except ShapelyError:
        nested = False
    if nested and isinstance(result, Polygon | MultiPolygon):
        return result
    if distance < 0.0 or workspace.is_empty:
        return Polygon()
    x_min, y_min, x_max, y_max = workspace.bounds
    return shapely.box(x_min - distance, y_min - distance, x_max + distance, y_max + distance)


def second_opinion(rings: Sequence[FloatArray], edges: FloatArray, footprint: FloatArray) -> list[FloatArray]:
    """Positions p with p + F inside a floor by GEOS, or a box around all of them where GEOS fails, too.

    Args:
        rings: The floor's rings, shape (n, 2) each [m].
        edges: All their edges, shape (E, 2, 2) [m].
        footprint: Convex polygon F relative to p, shape (n, 2) [m].

    Returns:
        Rings, outer ones counter-clockwise, holes clockwise.
    """
    if not rings:
        return []
    start = footprint[0]
    try:
        floor: BaseGeometry = Polygon()
        for ring in rings:
            floor = shapely.symmetric_difference(floor, Polygon(ring))
        sums = (edges[:, :, None, :] - footprint).reshape(len(edges), -1, 2)
        walls = shapely.union_all(shapely.convex_hull(shapely.linestrings(sums)))
        return polygon_rings(shapely.transform(floor, lambda points: points - start).difference(walls))
    except (ShapelyError, ValueError):
        corners = edges.reshape(-1, 2) - start
        return polygon_rings(shapely.box(*corners.min(axis=0), *corners.max(axis=0)))
