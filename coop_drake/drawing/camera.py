"""Where to stand to see the whole floor."""

from __future__ import annotations

from math import cos, radians, sin, tan

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.tree.pose import FloatArray

_ASPECT = 4 / 3  # Browser windows are seldom narrower than this.


def camera_pose(
    workspace: Polygon,
    height: float,
    *,
    elevation: float = radians(62.0),
    turn: float = 0.0,
    fill: float = 0.92,
    field_of_view: float = radians(75.0),
) -> tuple[FloatArray, FloatArray]:
    """Return the camera's position and its target, from which the workspace just fills the picture.

    Args:
        workspace: The floor [m].
        height: Height up to which things stand on it [m].
        elevation: How steeply the camera looks down [rad].
        turn: How far round it stands, counter-clockwise, from where it looks along +y [rad].
        fill: Part of the picture that the floor and what stands on it may fill.
        field_of_view: Of the camera, from bottom to top [rad]; Meshcat's own if not given.

    Returns:
        Position and target, each of shape (3,), in W [m].
    """
    half_height = tan(field_of_view / 2)
    half_width = half_height * _ASPECT
    outline = shapely.get_coordinates(workspace.convex_hull)[:-1]
    corners = np.array([[x, y, z] for x, y in outline for z in (0.0, height)])
    right = np.array([cos(turn), sin(turn), 0.0])
    ahead = np.array([-sin(turn), cos(turn), 0.0])
    up = sin(elevation) * ahead + [0.0, 0.0, cos(elevation)]
    away = np.cross(right, up)
    x_min, y_min, x_max, y_max = workspace.bounds
    target = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
    distance = (x_max - x_min + y_max - y_min) / half_height
    for _ in range(40):
        offsets = corners - target
        depth = distance - offsets @ away
        vertical = offsets @ up / depth / half_height
        horizontal = offsets @ right / depth / half_width
        rise, drift = (0.5 * float(seen.max() + seen.min()) for seen in (vertical, horizontal))
        target += 0.5 * rise * half_height * distance / sin(elevation) * ahead
        target += 0.5 * drift * half_width * distance * right
        extent = max(vertical.max() - rise, horizontal.max() - drift)
        distance *= (extent / fill) ** 0.5
    return target + distance * away, target
