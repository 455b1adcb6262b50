"""The polygons among the parts of a shape."""

from __future__ import annotations

import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry


def parts_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons that a shape consists of; lines, points and empty polygons are dropped."""
    parts = shapely.get_parts(shape)
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def component_at(shape: BaseGeometry, point: Point) -> Polygon:
    """The polygon among the parts of a shape that holds a point, an empty one if none does."""
    return next((part for part in parts_of(shape) if part.contains(point)), Polygon())
