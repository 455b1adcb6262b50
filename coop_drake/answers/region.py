"""Regions in files: the rings of a polygon, without their closing corners."""

from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Annotated

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.geometry.parts import corners_of
from coop_drake.tree.pose import FloatArray
from coop_drake.typed_data import Codec, DataError, Number, convert, convert_class


def _read_points(value: object, key: str, *, least: int) -> FloatArray:
    """Read a list of points, shape (n, 2) [m]."""
    if _holds_pairs(value):
        points = np.array(value, dtype=np.float64)
        if len(points) >= least and np.isfinite(points).all():
            return points
    convert(value, tuple[tuple[Number, Number], ...], key)  # This is slower; it names the wrong entry.
    raise DataError(key, value, f"a list of at least {least} {'corners' if least > 2 else 'points'}")


def _holds_pairs(value: object) -> bool:
    """Whether a value is a list of pairs of numbers; numpy would take texts and truth values for numbers."""
    if not isinstance(value, list) or set(map(type, value)) != {list} or set(map(len, value)) != {2}:
        return False
    return set(map(type, chain.from_iterable(value))) <= {int, float}


Ring = Annotated[FloatArray, Codec(partial(_read_points, least=3), np.ndarray.tolist)]

Corners = Annotated[FloatArray, Codec(partial(_read_points, least=1), np.ndarray.tolist)]
"""Corners of a convex polygon, or a single point [m]."""

Points = Annotated[FloatArray, Codec(partial(_read_points, least=2), np.ndarray.tolist)]
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


def _read_region(value: object, key: str) -> Polygon:
    rings = convert_class(value, Rings, key)
    polygon = Polygon(rings.outer, rings.holes)
    if not polygon.is_valid or polygon.area <= 0.0:
        reason = shapely.is_valid_reason(polygon)
        allowed = f"rings that cross neither themselves nor each other, but found: {reason}"
        raise DataError(key, value, allowed)
    return polygon


def _write_region(polygon: Polygon) -> object:
    outer, *holes = (corners.tolist() for corners in corners_of(polygon))
    return {"outer": outer, "holes": holes}


Region = Annotated[Polygon, Codec(_read_region, _write_region)]
"""A polygon that a file holds as its rings [m]."""
