"""What stands still in the scene: floor with a metre grid, walls, shelves, light and camera."""

from __future__ import annotations

from math import radians

import numpy as np
import shapely
from pydrake.geometry import Meshcat
from shapely import MultiLineString, Polygon, box, minimum_rotated_rectangle

from coop_drake.drawing.camera import camera_pose
from coop_drake.drawing.colours import EDGE, FLOOR_IN_SPACE, GRID, PILLAR, SHELF, WALL_IN_SPACE
from coop_drake.drawing.solids import (
    TriangleMesh,
    flat_mesh,
    joined,
    ring_lines,
    slab_mesh,
    wall_polygons,
)
from coop_drake.geometry.parts import parts_of
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.paint import rgba, set_mesh

_WALL_OPACITY = 0.42
"""Opacity of walls, behind which robots are to be seen."""

_OBSTACLE_OPACITY = 0.85
"""Opacity of pillars and shelves."""

_WALL_THICKNESS = 0.08
"""Thickness of walls around the floor [m]."""

_SHELF_LENGTH = 0.8
"""Length from which on a convex obstacle on the floor is drawn as shelves, else as a pillar [m]."""

_CONVEX = 0.99
"""Part of its convex hull from which on an obstacle counts as convex; others are walls inside the floor."""

_BOARDS = (0.12, 0.55, 1.0)
"""Tops of a shelf's boards, relative to the height of walls."""

_BOARD, _POST = 0.02, 0.025
"""Thickness of a shelf's boards, half the width of its posts [m]."""

FIELD_OF_VIEW = 30.0
"""Of the camera, from bottom to top [degrees]: narrow, so that walls look upright."""

_ELEVATION = radians(56.0)
"""How steeply the camera looks down [rad]: bodies behind walls are seen over them."""

FILL = 0.95
"""Part of the picture that the floor fills; headline and player lie outside of the picture."""

_LIGHTS = {"AmbientLight": 2.7, "FillLight": 1.6, "PointLightNegativeX": 0.0, "PointLightPositiveX": 0.0}
"""Intensities of Meshcat's lights: from everywhere alike, so that the floor has no shadows."""

_SKY, _HORIZON = [1.0, 1.0, 1.0], [0.90, 0.92, 0.95]
"""Red, green and blue of the background at its top and at its bottom."""


def place_camera(meshcat: Meshcat, workspace: Polygon, height: float) -> None:
    """Look at the whole workspace from above at an angle, in a narrow field of view."""
    position, target = camera_pose(
        workspace, height, elevation=_ELEVATION, fill=FILL, field_of_view=radians(FIELD_OF_VIEW)
    )
    distance = float(np.linalg.norm(position - target))
    camera = Meshcat.PerspectiveCamera(fov=FIELD_OF_VIEW, near=0.01 * distance, far=10.0 * distance)
    meshcat.SetCamera(camera)
    meshcat.SetCameraPose(position, target)


def floor_corners(workspace: Polygon, height: float) -> list[list[float]]:
    """Return corners [m] of a prism that holds the floor and all that stands on it up to a height [m]."""
    outline = shapely.get_coordinates(workspace.convex_hull)[:-1].tolist()
    return [[x, y, z] for x, y in outline for z in (0.0, height)]


def set_stage(meshcat: Meshcat, workspace: Polygon, wall_height: float) -> None:
    """Light the floor and put up what stands still on it, translucent where bodies may be behind.

    Walls and shelves are ``wall_height`` high [m].
    """
    _set_light(meshcat)
    set_mesh(meshcat, "/stage/floor", flat_mesh(parts_of(workspace), 0.0), rgba(FLOOR_IN_SPACE))
    meshcat.SetLineSegments("/stage/grid", *_grid(workspace, 0.002), 1.0, rgba(GRID))
    holes = [Polygon(ring) for ring in workspace.interiors]
    inside = [hole for hole in holes if hole.area < _CONVEX * hole.convex_hull.area]
    walls = wall_polygons(Polygon(workspace.exterior), _WALL_THICKNESS) + inside
    wall = rgba(WALL_IN_SPACE, _WALL_OPACITY)
    set_mesh(meshcat, "/stage/walls", slab_mesh(walls, 0.0, wall_height), wall)
    for index, hole in enumerate(hole for hole in holes if hole not in inside):
        if _length(hole) < _SHELF_LENGTH:
            path, mesh, colour = f"/stage/pillars/{index:02d}", slab_mesh([hole], 0.0, wall_height), PILLAR
        else:
            path, mesh, colour = f"/stage/shelves/{index:02d}", _shelf(hole, wall_height), SHELF
        set_mesh(meshcat, path, mesh, rgba(colour, _OBSTACLE_OPACITY))
    for name, height in (("foot", 0.005), ("top", wall_height)):
        meshcat.SetLineSegments(f"/stage/edges/{name}", *ring_lines([workspace], height), 2.0, rgba(EDGE))


def _set_light(meshcat: Meshcat) -> None:
    """Light the whole floor evenly, on white, without Meshcat's own grid and axes."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for name, colour in (("top_color", _SKY), ("bottom_color", _HORIZON)):
        meshcat.SetProperty("/Background/<object>", name, colour)
    for name, intensity in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{name}/<object>", "intensity", intensity)


def _grid(workspace: Polygon, height: float) -> tuple[FloatArray, FloatArray]:
    """Return both ends of lines a metre apart on the floor, each of shape (3, m) [m]."""
    x_min, y_min, x_max, y_max = workspace.bounds
    upright = [[(x, y_min), (x, y_max)] for x in np.arange(np.ceil(x_min), x_max)]
    level = [[(x_min, y), (x_max, y)] for y in np.arange(np.ceil(y_min), y_max)]
    on_floor = MultiLineString(upright + level).intersection(workspace)
    lines = [part for part in getattr(on_floor, "geoms", [on_floor]) if part.length > 0.0]
    ends = np.array([[line.coords[0], line.coords[-1]] for line in lines]).reshape(-1, 2, 2)
    raised = np.concatenate([ends, np.full((len(ends), 2, 1), height)], axis=2)
    return np.asfortranarray(raised[:, 0].T), np.asfortranarray(raised[:, 1].T)


def _length(shape: Polygon) -> float:
    """Return the length of the longer side of the smallest rectangle round a shape [m]."""
    corners = shapely.get_coordinates(minimum_rotated_rectangle(shape))
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())


def _shelf(shape: Polygon, height: float) -> TriangleMesh:
    """Return boards of the obstacle's own outline, with a post at every corner."""
    corners = np.asarray(shape.exterior.coords)[:-1, :2]
    posts = [box(x - _POST, y - _POST, x + _POST, y + _POST) for x, y in corners]
    inside = [part for post in posts for part in parts_of(post & shape)]
    boards = [slab_mesh([shape], part * height - _BOARD, part * height) for part in _BOARDS]
    return joined([slab_mesh(inside, 0.0, height), *boards])
