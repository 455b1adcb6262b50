"""Where to stand to see the whole floor."""

from __future__ import annotations

from math import cos, radians, sin, tan

import numpy as np
from shapely import Polygon

from coop_drake.geometry.pose import FloatArray

__all__ = ["camera_pose"]

_ELEVATION = radians(62.0)
_HALF_HEIGHT = tan(radians(75.0) / 2)  # Meshcat's vertical field of view.
_HALF_WIDTH = _HALF_HEIGHT * 4 / 3  # Browser windows are seldom narrower than this.
_FILL = 0.92  # Part of the picture that the floor may fill.


def camera_pose(workspace: Polygon, height: float) -> tuple[FloatArray, FloatArray]:
    """Return the camera's position and its target, from which the workspace just fills the picture.

    The camera looks along +y from above at an angle.

    Args:
        workspace: The floor [m].
        height: Height up to which things stand on it [m].

    Returns:
        Position and target, each of shape (3,), in W [m].
    """
    x_min, y_min, x_max, y_max = workspace.bounds
    corners = np.array([[x, y, z] for x in (x_min, x_max) for y in (y_min, y_max) for z in (0.0, height)])
    away = np.array([0.0, -cos(_ELEVATION), sin(_ELEVATION)])
    up = np.array([0.0, sin(_ELEVATION), cos(_ELEVATION)])
    target = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
    distance = x_max - x_min + y_max - y_min
    for _ in range(30):
        offsets = corners - target
        depth = distance - offsets @ away
        vertical = offsets @ up / depth / _HALF_HEIGHT
        horizontal = offsets[:, 0] / depth / _HALF_WIDTH
        centre = 0.5 * (vertical.max() + vertical.min())
        target[1] += 0.5 * centre * _HALF_HEIGHT * distance / sin(_ELEVATION)
        extent = max(vertical.max() - centre, float(np.abs(horizontal).max()))
        distance *= (extent / _FILL) ** 0.5
    return target + distance * away, target
