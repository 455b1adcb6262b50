"""The part of a floor near some positions: what a team there may meet, and some more."""

from __future__ import annotations

import shapely
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.parts import parts_of
from coop_drake.tree.pose import FloatArray

EXTRA_FLOOR = 1.0
"""The part of a floor near a path reaches this much further than the team [m]: wide cells are faster."""


def nearby(floor: Polygon | MultiPolygon, positions: FloatArray, reach: float) -> MultiPolygon:
    """The part of a floor that a team at some positions can touch, and ``EXTRA_FLOOR`` around it.

    Args:
        floor: Polygons with holes [m].
        positions: Positions p_WL, shape (k, 2) [m].
        reach: Distance of the team's furthest point from p_WL [m].
    """
    lower, upper = positions.min(axis=0) - reach - EXTRA_FLOOR, positions.max(axis=0) + reach + EXTRA_FLOOR
    return MultiPolygon(parts_of(floor.intersection(shapely.box(*lower, *upper))))
