"""The polygons among the parts of a shape, and the corners of their rings."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.tree.pose import FloatArray


def parts_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons that a shape consists of; lines, points and empty polygons are dropped."""
    if isinstance(shape, Polygon):
        return [] if shape.is_empty else [shape]
    parts = shapely.get_parts(shape)
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def corners_of(polygon: Polygon) -> list[FloatArray]:
    """The corners of every ring as it stands, the outer ring first, none repeated, shape (n, 2) each [m]."""
    return [shapely.get_coordinates(ring)[:-1] for ring in (polygon.exterior, *polygon.interiors)]


def polygon_rings(shape: BaseGeometry) -> list[FloatArray]:
    """The corners of all rings of a shape's polygons, outer rings counter-clockwise, holes clockwise [m]."""
    return [corners for part in parts_of(shape) for corners in corners_of(orient(part))]


def extent_of(shape: BaseGeometry) -> float:
    """Diagonal of the bounding box of a shape [m]."""
    x_min, y_min, x_max, y_max = shape.bounds
    return float(np.hypot(x_max - x_min, y_max - y_min))


def component_at(shape: BaseGeometry, point: Point) -> Polygon:
    """The polygon among the parts of a shape that holds a point, an empty one if none does."""
    for part in parts_of(shape):
        if part.contains(point):
            return part
    return Polygon()
