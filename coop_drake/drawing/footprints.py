"""Footprints of the team on the floor at one configuration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import MultiPoint, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class BodyFootprint:
    """Where one body stands.

    Attributes:
        name: Scoped name of the body.
        robot: Index of its robot, None for the object.
        shape: Its projection to the floor, in W [m].
    """

    name: str
    robot: int | None
    shape: BaseGeometry


def team_footprints(tree: ComponentTree, configuration: FloatArray) -> list[BodyFootprint]:
    """Return the footprint of every body at z = (x, y, theta, q...), shape (3 + n,), the object's first."""
    footprints = []
    for component, X_WC in zip(tree.components, tree.poses(configuration), strict=True):
        for body in component.bodies:
            hulls = [
                MultiPoint(X_WC.apply(np.atleast_2d(shape.vertices))).convex_hull.buffer(shape.radius)
                for shape in body.shapes
            ]
            footprints.append(BodyFootprint(body.name, body.robot, union_all(hulls)))
    return sorted(footprints, key=lambda footprint: footprint.robot is not None)
