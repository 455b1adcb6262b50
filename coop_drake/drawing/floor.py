"""Floors and bodies on axes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba_array
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from shapely import MultiPoint, Polygon, box, get_coordinates, union_all
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.drawing.colours import FLOOR, INK, OBJECT, WALL, robot_colour
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

# Footprints of the team on the floor at one configuration.


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


# Drawing the floor plan and the team on it.

_RIM = 0.3
"""Width of the wall drawn around the floor [m]."""


def outline_of(rings: Iterable[FloatArray]) -> Outline:
    """Return one path of several closed rings, each of shape (n, 2) with its first point repeated at the end.

    Matplotlib leaves out what a ring encloses that runs the other way round.
    """
    return Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))


def draw_polygon(ax: Axes, polygon: BaseGeometry, **style: Any) -> None:
    """Add a polygon, or a shape of several polygons, with its holes to ``ax``."""
    if not polygon.is_empty:
        ax.add_patch(PathPatch(outline_of(_rings(polygon)), **style))


def draw_workspace(ax: Axes, workspace: Polygon) -> None:
    """Draw the floor white, everything else as wall, and set equal axes in metres."""
    frame = frame_of(workspace)
    draw_polygon(ax, box(*frame), facecolor=WALL, edgecolor="none", zorder=0)
    draw_polygon(ax, workspace, facecolor=FLOOR, edgecolor=INK, linewidth=1.0, zorder=1)
    ax.set(xlim=frame[::2], ylim=frame[1::2], aspect="equal", xlabel="x [m]", ylabel="y [m]")


def frame_of(workspace: Polygon) -> tuple[float, float, float, float]:
    """Return the limits (x_min, y_min, x_max, y_max) of a picture of the floor with a rim of wall [m]."""
    x_min, y_min, x_max, y_max = workspace.bounds
    return x_min - _RIM, y_min - _RIM, x_max + _RIM, y_max + _RIM


def draw_team(
    ax: Axes,
    tree: ComponentTree,
    configuration: FloatArray,
    *,
    colour: Any = None,
    alpha: float = 0.55,
    zorder: float = 3.0,
) -> None:
    """Draw every body's footprint at z = (x, y, theta, q...), shape (3 + n,) [m, rad].

    Bodies have one colour, or by default the object's and each robot's own; ``alpha`` is that of the filling.
    """
    footprints = team_footprints(tree, configuration)
    own = [OBJECT if body.robot is None else robot_colour(body.robot) for body in footprints]
    edges = own if colour is None else [colour] * len(footprints)
    outlines = [outline_of(_rings(body.shape)) for body in footprints]
    bodies = PathCollection(
        outlines, facecolors=to_rgba_array(edges, alpha), edgecolors=edges, linewidths=0.9, zorder=zorder
    )
    ax.add_collection(bodies)


def _rings(shape: BaseGeometry) -> list[FloatArray]:
    """Return outer rings of polygons anticlockwise and their holes clockwise, each of shape (n, 2) [m]."""
    parts = [orient(part) for part in getattr(shape, "geoms", [shape])]
    return [get_coordinates(ring) for part in parts for ring in (part.exterior, *part.interiors)]


def team_legend(tree: ComponentTree) -> list[Patch]:
    """Return legend entries that say which colour is the object's and which each robot's."""
    names = {
        body.robot: body.name.split("::")[0] for component in tree.components for body in component.bodies
    }
    robots = sorted(robot for robot in names if robot is not None)
    return [
        Patch(color=OBJECT, alpha=0.55, label="object"),
        *(Patch(color=robot_colour(robot), alpha=0.55, label=names[robot]) for robot in robots),
    ]
