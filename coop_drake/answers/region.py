"""Regions in files: the rings of a polygon, without their closing corners."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.geometry.polygons import corners_of
from coop_drake.tree.pose import FloatArray
from coop_drake.typed_data import Codec, DataError, Number

Pairs = tuple[tuple[Number, Number], ...]


def _of_points(least: int) -> Codec:
    """Return the codec of a list of points, shape (n, 2) [m]."""

    def read(pairs: Pairs) -> FloatArray:
        if len(pairs) < least:
            allowed = f"a list of at least {least} {'corners' if least > 2 else 'points'}"
            raise DataError("", [list(pair) for pair in pairs], allowed)
        return np.array(pairs, dtype=np.float64)

    return Codec(Pairs, read, np.ndarray.tolist)


Ring = Annotated[FloatArray, _of_points(3)]

Corners = Annotated[FloatArray, _of_points(1)]
"""Corners of a convex polygon, or a single point [m]."""

Points = Annotated[FloatArray, _of_points(2)]
"""A polyline that a file holds as the list of its points [m]."""


@dataclass(frozen=True)
class Rings:
    """A polygon as it stands in a file.

    Attributes:
        outer: Corners of the outer ring [m].
        holes: Corners of the inner rings [m].
    """

    outer: Ring
    holes: tuple[Ring, ...]


def _read_region(rings: Rings) -> Polygon:
    polygon = Polygon(rings.outer, rings.holes)
    if not polygon.is_valid or polygon.area <= 0.0:
        reason = shapely.is_valid_reason(polygon)
        allowed = f"rings that cross neither themselves nor each other, but found: {reason}"
        raise DataError("", _write_region(polygon), allowed)
    return polygon


def _write_region(polygon: Polygon) -> object:
    outer, *holes = (corners.tolist() for corners in corners_of(polygon))
    return {"outer": outer, "holes": holes}


Region = Annotated[Polygon, Codec(Rings, _read_region, _write_region)]
"""A polygon that a file holds as its rings [m]."""
