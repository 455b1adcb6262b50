"""Reduces footprints: imported models have dozens of them on a component, many with many corners."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPoint, Polygon, box
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import Body, ConvexShape
from coop_drake.tree.pose import FloatArray

_FEW = 16
"""Footprints with at most this many corners are not simplified."""

_GROWTH = 0.003
"""Largest growth of a footprint where corners are removed [m]."""


def enclosed_in_fewer(points: FloatArray) -> FloatArray:
    """Corners of a convex polygon that encloses another, and reaches no more than 3 mm beyond it.

    Shapes (n, 2) [m]; fewer corners if the polygon given has many, otherwise its own.
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
    return shapely.get_coordinates(shapely.orient_polygons(outer))[:-1]


def without_covered(bodies: tuple[Body, ...], may_overlap: frozenset[tuple[str, str]]) -> tuple[Body, ...]:
    """Remove the shapes of a component that a shape of another body of the same robot covers.

    A shape can be removed if everything that would collide with it also collides with the other one: the
    other body must not be exempt from a collision that the shape's own body is not exempt from.

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
    sizes = [_core(shape).buffer(shape.radius).area for _, shape in every]
    largest_first = sorted(range(len(every)), key=lambda place: -sizes[place])
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


def _core(shape: ConvexShape) -> BaseGeometry:
    return MultiPoint(shape.vertices).convex_hull


def _covers(larger: ConvexShape, shape: ConvexShape) -> bool:
    """Whether a convex shape contains another, which its corners decide."""
    corners = shapely.points(shape.vertices)
    return bool(np.all(shapely.distance(corners, _core(larger)) <= larger.radius - shape.radius))
