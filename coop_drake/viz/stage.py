"""The stage of a recording: floor, walls, light, the path, the outline of every cell."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat, Rgba
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.drawing.camera import camera_pose
from coop_drake.drawing.solids import flat_mesh, parts_of, ring_lines, wall_mesh, wall_polygons
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.plan import Plan
from coop_drake.simulation.log import IntArray

__all__ = ["place_camera", "set_cells", "set_floor", "set_light", "set_path", "switch_cells"]

_FLOOR = Rgba(0.95, 0.95, 0.93, 1.0)
_WALL = Rgba(0.45, 0.48, 0.52, 0.45)
_EDGE = Rgba(0.13, 0.13, 0.13, 1.0)
_PATH = Rgba(0.0, 0.45, 0.70, 1.0)
_CELL = Rgba(0.90, 0.62, 0.0, 1.0)
_WALL_THICKNESS = 0.08  # [m]
_LIGHTS = {
    "AmbientLight": 1.6,
    "DirectionalLight": 0.8,
    "FillLight": 0.5,
    "PointLightNegativeX": 0.0,
    "PointLightPositiveX": 0.0,
}


def place_camera(meshcat: Meshcat, workspace: Polygon, height: float) -> None:
    """Look at the whole workspace from above at an angle."""
    meshcat.SetCameraPose(*camera_pose(workspace, height))


def set_floor(meshcat: Meshcat, workspace: Polygon, wall_height: float) -> None:
    """Lay the floor and stand the walls up, translucent, so that nothing hides behind them.

    Args:
        meshcat: Where to draw.
        workspace: The floor [m].
        wall_height: Height of the walls [m].
    """
    _set_flat(meshcat, "/stage/floor", workspace, 0.0, _FLOOR)
    walls = wall_polygons(workspace, _WALL_THICKNESS)
    solid = wall_mesh(walls, wall_height)
    meshcat.SetTriangleMesh("/stage/walls", solid.vertices, solid.faces, _WALL)
    for name, height in (("foot", 0.005), ("top", wall_height)):
        meshcat.SetLineSegments(f"/stage/edges/{name}", *ring_lines([workspace], height), 2.0, _EDGE)


def set_light(meshcat: Meshcat) -> None:
    """Light the whole floor evenly, on white, without Meshcat's grid and axes."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for name in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background", name, [1.0, 1.0, 1.0])
    for name, intensity in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{name}/<object>", "intensity", intensity)


def set_path(meshcat: Meshcat, positions: FloatArray) -> None:
    """Draw the object's path on the floor, a dot if it never moved; positions of shape (T, 2) [m]."""
    path = (LineString(positions) if len(positions) > 1 else Point(positions[0])).simplify(0.002)
    _set_flat(meshcat, "/stage/path", path.buffer(0.015), 0.010, _PATH)


def set_cells(meshcat: Meshcat, plan: Plan) -> None:
    """Draw the outline of every cell, hidden but for the first one's."""
    for index, cell in enumerate(plan.cells):
        _set_flat(meshcat, _cell_path(index), cell.tidied.boundary.buffer(0.02), 0.015, _CELL)
        meshcat.SetProperty(_cell_path(index), "visible", index == 0)


def switch_cells(meshcat: Meshcat, times: FloatArray, cell_index: IntArray) -> None:
    """Record that every cell's outline is shown while the cell is the current one.

    Args:
        meshcat: A Meshcat that is recording.
        times: Times of the recording's frames [s], shape (F,).
        cell_index: Cell of each frame, shape (F,).
    """
    shown = np.unique(cell_index)
    for index in shown:
        meshcat.SetProperty(_cell_path(index), "visible", bool(index == cell_index[0]), float(times[0]))
    for frame in np.flatnonzero(np.diff(cell_index)) + 1:
        meshcat.SetProperty(_cell_path(cell_index[frame - 1]), "visible", False, float(times[frame]))
        meshcat.SetProperty(_cell_path(cell_index[frame]), "visible", True, float(times[frame]))


def _set_flat(meshcat: Meshcat, path: str, shape: BaseGeometry, height: float, colour: Rgba) -> None:
    mesh = flat_mesh(parts_of(shape), height)
    meshcat.SetTriangleMesh(path, mesh.vertices, mesh.faces, colour)


def _cell_path(index: int) -> str:
    return f"/stage/cells/{index:03d}"
