"""The stage of the scene: floor with a metre grid, walls, shelves, light and camera."""

from __future__ import annotations

from math import radians

import numpy as np
import shapely
from pydrake.geometry import Meshcat, Rgba
from shapely import MultiLineString, Polygon, box, minimum_rotated_rectangle

from coop_drake.drawing.camera import camera_pose
from coop_drake.drawing.solids import (
    TriangleMesh,
    flat_mesh,
    joined,
    parts_of,
    ring_lines,
    slab_mesh,
    wall_mesh,
    wall_polygons,
)
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.paint import set_mesh

__all__ = ["place_camera", "set_stage"]

_FLOOR = Rgba(0.97, 0.96, 0.94, 1.0)
_GRID = Rgba(0.72, 0.72, 0.72, 1.0)
_WALL = Rgba(0.50, 0.55, 0.62, 0.42)
_PILLAR = Rgba(0.42, 0.46, 0.52, 0.85)
_SHELF = Rgba(0.72, 0.55, 0.36, 0.85)
_EDGE = Rgba(0.13, 0.15, 0.18, 1.0)
_WALL_THICKNESS = 0.08  # [m]
_SHELF_LENGTH = 0.8  # From this length on an obstacle on the floor is drawn as shelves [m].
_BOARDS = (0.12, 0.55, 1.0)  # Tops of a shelf's boards, as parts of the walls' height.
_BOARD, _POST = 0.02, 0.025  # Thickness of boards, half the width of posts [m].
_LENS = 30.0  # Field of view from bottom to top [degrees].
_ELEVATION = radians(56.0)  # How steeply the camera looks down.
_FILL = 0.86  # Part of the picture filled.
_BACKGROUND = {"top_color": (1.0, 1.0, 1.0), "bottom_color": (0.90, 0.92, 0.95)}
_LIGHTS = {
    "AmbientLight": 2.7,
    "FillLight": 1.6,
    "PointLightNegativeX": 0.0,
    "PointLightPositiveX": 0.0,
}


def place_camera(meshcat: Meshcat, workspace: Polygon, height: float) -> None:
    """Look at the whole workspace from above at an angle, through a lens that keeps walls upright."""
    position, target = camera_pose(
        workspace, height, elevation=_ELEVATION, fill=_FILL, field_of_view=radians(_LENS)
    )
    distance = float(np.linalg.norm(position - target))
    camera = Meshcat.PerspectiveCamera(fov=_LENS, near=0.01 * distance, far=10.0 * distance)
    meshcat.SetCamera(camera)
    meshcat.SetCameraPose(position, target)


def set_stage(meshcat: Meshcat, workspace: Polygon, wall_height: float) -> None:
    """Light the floor and put up what stands still on it, translucent where something may be behind.

    Args:
        meshcat: Where to draw.
        workspace: The floor [m].
        wall_height: Height of walls and shelves [m].
    """
    _set_light(meshcat)
    set_mesh(meshcat, "/stage/floor", flat_mesh(parts_of(workspace), 0.0), _FLOOR)
    meshcat.SetLineSegments("/stage/grid", *_grid(workspace, 0.002), 1.0, _GRID)
    walls = wall_polygons(Polygon(workspace.exterior), _WALL_THICKNESS)
    set_mesh(meshcat, "/stage/walls", wall_mesh(walls, wall_height), _WALL)
    for index, hole in enumerate(Polygon(ring) for ring in workspace.interiors):
        if _length(hole) < _SHELF_LENGTH:
            set_mesh(meshcat, f"/stage/pillars/{index:02d}", wall_mesh([hole], wall_height), _PILLAR)
        else:
            set_mesh(meshcat, f"/stage/shelves/{index:02d}", _shelf(hole, wall_height), _SHELF)
    for name, height in (("foot", 0.005), ("top", wall_height)):
        meshcat.SetLineSegments(f"/stage/edges/{name}", *ring_lines([workspace], height), 2.0, _EDGE)


def _set_light(meshcat: Meshcat) -> None:
    """Light the whole floor evenly, on white, without Meshcat's own grid and axes."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for name, colour in _BACKGROUND.items():
        meshcat.SetProperty("/Background/<object>", name, list(colour))
    for name, intensity in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{name}/<object>", "intensity", intensity)


def _grid(workspace: Polygon, height: float) -> tuple[FloatArray, FloatArray]:
    """Ends of lines a metre apart on the floor, each of shape (3, m) [m]."""
    x_min, y_min, x_max, y_max = workspace.bounds
    upright = [[(x, y_min), (x, y_max)] for x in np.arange(np.ceil(x_min), x_max)]
    level = [[(x_min, y), (x_max, y)] for y in np.arange(np.ceil(y_min), y_max)]
    on_floor = MultiLineString(upright + level).intersection(workspace)
    lines = [part for part in getattr(on_floor, "geoms", [on_floor]) if part.length > 0.0]
    ends = np.array([[line.coords[0], line.coords[-1]] for line in lines]).reshape(-1, 2, 2)
    raised = np.concatenate([ends, np.full((len(ends), 2, 1), height)], axis=2)
    return np.asfortranarray(raised[:, 0].T), np.asfortranarray(raised[:, 1].T)


def _length(shape: Polygon) -> float:
    """Length of the longer side of the tightest rectangle round a shape [m]."""
    corners = shapely.get_coordinates(minimum_rotated_rectangle(shape))
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())


def _shelf(shape: Polygon, height: float) -> TriangleMesh:
    """Boards of the obstacle's own outline, held by a post at every corner."""
    corners = np.asarray(shape.exterior.coords)[:-1, :2]
    posts = [box(x - _POST, y - _POST, x + _POST, y + _POST) for x, y in corners]
    inside = [part for post in posts for part in parts_of(post & shape)]
    boards = [slab_mesh([shape], part * height - _BOARD, part * height) for part in _BOARDS]
    return joined([wall_mesh(inside, height), *boards])
