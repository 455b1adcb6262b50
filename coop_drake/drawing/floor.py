"""Drawing the floor plan and the team on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.drawing.colours import FLOOR, INK, OBJECT, WALL, robot_colour
from coop_drake.drawing.footprints import team_footprints
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

__all__ = ["draw_polygon", "draw_team", "draw_workspace", "team_legend"]

_RIM = 0.3  # Wall drawn around the floor [m].


def draw_polygon(ax: Axes, polygon: BaseGeometry, **style: Any) -> None:
    """Add a polygon with its holes to ``ax``; polygons of several parts are drawn part by part."""
    for part in getattr(polygon, "geoms", [polygon]):
        oriented = orient(part)  # Matplotlib leaves out what a ring the other way round encloses.
        rings = [oriented.exterior, *oriented.interiors]
        outline = Outline.make_compound_path(
            *(Outline(np.asarray(ring.coords), closed=True) for ring in rings)
        )
        ax.add_patch(PathPatch(outline, **style))


def draw_workspace(ax: Axes, workspace: Polygon) -> None:
    """Draw the floor white, everything else as wall, and set equal axes in metres."""
    x_min, y_min, x_max, y_max = workspace.bounds
    frame = box(x_min - _RIM, y_min - _RIM, x_max + _RIM, y_max + _RIM)
    draw_polygon(ax, frame, facecolor=WALL, edgecolor="none", zorder=0)
    draw_polygon(ax, workspace, facecolor=FLOOR, edgecolor=INK, linewidth=1.0, zorder=1)
    ax.set_xlim(frame.bounds[0], frame.bounds[2])
    ax.set_ylim(frame.bounds[1], frame.bounds[3])
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")


def draw_team(
    ax: Axes,
    tree: ComponentTree,
    configuration: FloatArray,
    *,
    colour: Any = None,
    alpha: float = 0.55,
    zorder: float = 3.0,
) -> None:
    """Draw every body's footprint at one configuration.

    Args:
        ax: Where to draw.
        tree: The team.
        configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        colour: One colour for all bodies; by default the object's and each robot's own.
        alpha: Opacity of the filling.
        zorder: Drawing order.
    """
    for footprint in team_footprints(tree, configuration):
        own = OBJECT if footprint.robot is None else robot_colour(footprint.robot)
        fill = own if colour is None else colour
        draw_polygon(ax, footprint.shape, facecolor=fill, edgecolor="none", alpha=alpha, zorder=zorder)
        draw_polygon(
            ax, footprint.shape, facecolor="none", edgecolor=fill, linewidth=0.9, zorder=zorder + 0.1
        )


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
