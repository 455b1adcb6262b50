"""Projects collision shapes to the floor; a footprint is a convex hull enlarged by a radius."""

from math import cos, pi, sin

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Shape, Sphere
from pydrake.math import RigidTransform
from shapely import MultiPoint, Polygon

from coop_drake.plant.shadows import enclosed_in_fewer
from coop_drake.tree.component_tree import ConvexShape
from coop_drake.tree.pose import FloatArray

SUPPORTS = 64
"""Tangent lines that enclose a curved outline: the polygon exceeds it by at most 0.13 % of its radius."""

DIGITS = 12
"""Decimals of a metre that are kept; the rest is rounding of rotations in the files."""

_FLAT = 1e-9
"""Smallest horizontal part of a unit axis that is not taken for rounding [-]."""
_THIN = 1e-6
"""Radius that a footprint without an area gets [m]."""


def project(shape: Shape, X_CG: RigidTransform) -> ConvexShape:
    """Project a collision shape to the plane.

    Footprints of spheres, capsules, boxes, hulls and upright or lying cylinders are exact. Ellipsoids and
    tilted cylinders are enclosed by ``SUPPORTS`` tangents. A mesh counts as its convex hull, as in Drake's
    proximity queries; a hull of many corners is enclosed by one of fewer, at most 3 mm larger.

    Args:
        shape: The shape in its geometry frame G.
        X_CG: Pose of G in a frame C whose z axis is vertical.

    Returns:
        The footprint in C.

    Raises:
        TypeError: The shape has no bounded footprint, for example a half-space.
    """
    centre = X_CG.translation()[:2]
    R = X_CG.rotation().matrix()
    match shape:
        case Sphere():
            return ConvexShape(centre[None, :].round(DIGITS), shape.radius())
        case Capsule():
            arm = 0.5 * shape.length() * R[:2, 2]
            return _capsule(centre, arm, shape.radius())
        case Cylinder():
            return _cylinder(centre, R[:, 2], shape.radius(), 0.5 * shape.length())
        case Ellipsoid():
            return _ellipsoid(centre, R[:2] * np.array([shape.a(), shape.b(), shape.c()]))
        case Box():
            corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
            return hull(centre + (corners * shape.size()) @ R[:2].T)
        case Convex() | Mesh():
            solid = shape.GetConvexHull()
            points = np.array([solid.vertex(i) for i in range(solid.num_vertices())])
            shadow = hull(centre + points @ R[:2].T)
            return ConvexShape(enclosed_in_fewer(shadow.vertices), shadow.radius)
    raise TypeError(f"{type(shape).__name__} has no bounded footprint")


def hull(points: FloatArray) -> ConvexShape:
    """Convex hull of points in the plane, shape (n, 2) [m]; a flat hull gets a micrometre of thickness."""
    outline = MultiPoint(points.round(DIGITS)).convex_hull
    if not isinstance(outline, Polygon):
        ends = np.array(outline.coords)
        return ConvexShape(ends, _THIN)
    ring = np.array(outline.exterior.coords)[:-1]
    return ConvexShape(ring if outline.exterior.is_ccw else ring[::-1].copy())


def _capsule(centre: FloatArray, arm: FloatArray, radius: float) -> ConvexShape:
    if np.hypot(*arm) <= _FLAT:
        return ConvexShape(centre[None, :].round(DIGITS), radius)
    return ConvexShape(np.array([centre - arm, centre + arm]).round(DIGITS), radius)


def _cylinder(centre: FloatArray, axis: FloatArray, radius: float, half_length: float) -> ConvexShape:
    """Support along n: the disc's rim gives r sqrt(1 - (a.n)^2), the axis h |a.n|."""
    if np.hypot(axis[0], axis[1]) <= _FLAT:
        return ConvexShape(centre[None, :].round(DIGITS), radius)
    along = np.arctan2(axis[1], axis[0])
    angles = along + 2.0 * pi * np.arange(SUPPORTS) / SUPPORTS
    share = np.cos(angles) * axis[0] + np.sin(angles) * axis[1]
    support = radius * np.sqrt(np.maximum(0.0, 1.0 - share**2)) + half_length * np.abs(share)
    return hull(centre + _tangent_corners(angles, support))


def _ellipsoid(centre: FloatArray, shadow: FloatArray) -> ConvexShape:
    """Support along n: |shadow^T n|, with shadow the projected semi-axes as columns, shape (2, 3)."""
    squares = np.linalg.eigvalsh(shadow @ shadow.T)
    if squares[1] - squares[0] <= _FLAT * squares[1]:
        return ConvexShape(centre[None, :].round(DIGITS), float(np.sqrt(squares[1])))
    angles = 2.0 * pi * np.arange(SUPPORTS) / SUPPORTS
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    return hull(centre + _tangent_corners(angles, np.linalg.norm(normals @ shadow, axis=1)))


def _tangent_corners(angles: FloatArray, support: FloatArray) -> FloatArray:
    """Corners between neighbouring tangent lines n(angle) . x = support, shape (n, 2)."""
    step = 2.0 * pi / len(angles)
    following = np.roll(support, -1)
    across = (following - support * cos(step)) / sin(step)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    tangents = np.column_stack([-np.sin(angles), np.cos(angles)])
    return support[:, None] * normals + across[:, None] * tangents
