"""Exact clearances of bodies to the walls and to each other at one configuration."""

from collections.abc import Iterator

from shapely import LineString, Point, Polygon, get_coordinates
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import Body, ComponentTree, ConvexShape
from coop_drake.tree.pose import FloatArray, PlanarPose


def core(shape: ConvexShape, X_WC: PlanarPose) -> BaseGeometry:
    """The hull of a shape without its radius, in W: a point, a segment or a polygon."""
    points = X_WC.apply(shape.vertices)
    if len(points) == 1:
        return Point(points[0])
    return LineString(points) if len(points) == 2 else Polygon(points)


def wall_clearance(body: Body, X_WC: PlanarPose, workspace: Polygon) -> float:
    """Signed distance of a body to the walls [m]: negative or zero where it leaves the workspace."""
    clearances = [float("inf")]
    for shape in body.shapes:
        solid = core(shape, X_WC)
        gap = workspace.boundary.distance(solid)
        if not workspace.contains(solid):
            corners = get_coordinates(solid.difference(workspace))
            gap = -max((Point(corner).distance(workspace) for corner in corners), default=0.0)
        clearances.append(gap - shape.radius)
    return min(clearances)


def body_clearance(first: Body, X_WC: PlanarPose, second: Body, X_WD: PlanarPose) -> float:
    """Distance between two bodies [m]; zero or negative where they touch or overlap."""
    return min(
        (
            float(core(a, X_WC).distance(core(b, X_WD))) - a.radius - b.radius
            for a in first.shapes
            for b in second.shapes
        ),
        default=float("inf"),
    )


def collisions(tree: ComponentTree, z: FloatArray, workspace: Polygon) -> Iterator[tuple[str, str, float]]:
    """Yield ``(body, what it hits, clearance)`` for every body that leaves the floor or touches another.

    ``z``: (x, y, theta, q...), shape (3 + n,).
    """
    poses = tree.poses(z)
    for X_WC, component in zip(poses, tree.components, strict=True):
        for body in component.bodies:
            clearance = wall_clearance(body, X_WC, workspace)
            if clearance <= 0.0:
                yield body.name, "the walls", clearance
    for (i, j), (k, m) in tree.collision_pairs:
        first, second = tree.components[i].bodies[j], tree.components[k].bodies[m]
        clearance = body_clearance(first, poses[i], second, poses[k])
        if clearance <= 0.0:
            yield first.name, second.name, clearance
