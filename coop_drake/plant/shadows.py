"""Fewer and simpler footprints that stand for the same: models from elsewhere bring dozens to a component."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPoint, Polygon, box
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import Body, ConvexShape
from coop_drake.tree.pose import FloatArray

__all__ = ["enclosed_in_fewer", "without_covered"]

_FEW = 16
"""Footprints of so many corners, or fewer, stay as they are."""

_GROWTH = 0.003
"""How far a footprint may grow where that saves corners [m]."""


def enclosed_in_fewer(points: FloatArray) -> FloatArray:
    """Corners of a convex polygon that encloses another, and reaches no more than 3 mm beyond it.

    Args:
        points: Corners of a convex polygon, shape (n, 2) [m].

    Returns:
        Fewer corners if the polygon has many, otherwise those given.
    """
    from coop_drake.geometry.simplify import simplify_inward

    if len(points) <= _FEW:
        return points
    inner = Polygon(points)
    around = box(*inner.buffer(1.0).bounds)
    (hole,) = simplify_inward(Polygon(around.exterior, [inner.exterior]), _GROWTH).interiors
    outer = Polygon(hole).convex_hull
    if not outer.buffer(1e-9).covers(inner):
        return points
    corners: FloatArray = shapely.get_coordinates(shapely.orient_polygons(outer))[:-1]
    return corners


def without_covered(bodies: tuple[Body, ...], may_overlap: frozenset[tuple[str, str]]) -> tuple[Body, ...]:
    """Bodies of one component without the shapes that another body of the same robot covers.

    A shape may go if whatever would hit it would hit the other one as well: the other body is exempt from
    collision with nothing that its own body is not exempt from, too.

    Args:
        bodies: Bodies that are rigid with each other, in the component's frame.
        may_overlap: Pairs of bodies that are never checked against each other.

    Returns:
        The same bodies in the same order, some with fewer shapes, or none.
    """
    exempt: dict[str, set[str]] = {body.name: set() for body in bodies}
    for first, second in may_overlap:
        exempt.setdefault(first, set()).add(second)
        exempt.setdefault(second, set()).add(first)
    every = [(body, shape) for body in bodies for shape in body.shapes]
    largest_first = sorted(range(len(every)), key=lambda place: -_size(every[place][1]))
    kept: list[int] = []
    for place in largest_first:
        body, shape = every[place]
        if not any(
            other.robot == body.robot
            and exempt[other.name] - {body.name} <= exempt[body.name]
            and _covers(larger, shape)
            for other, larger in (every[index] for index in kept)
        ):
            kept.append(place)
    left = {id(every[place][1]) for place in kept}
    return tuple(
        Body(body.name, body.robot, tuple(shape for shape in body.shapes if id(shape) in left))
        for body in bodies
    )


def _size(shape: ConvexShape) -> float:
    return float(_core(shape).buffer(shape.radius).area)


def _core(shape: ConvexShape) -> BaseGeometry:
    return MultiPoint(shape.vertices).convex_hull


def _covers(larger: ConvexShape, shape: ConvexShape) -> bool:
    """Both are convex, so that the smaller one's corners decide."""
    corners = shapely.points(shape.vertices)
    return bool(np.all(shapely.distance(corners, _core(larger)) <= larger.radius - shape.radius))
