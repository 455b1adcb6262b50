"""The camera sees the whole floor, whatever its shape."""

import numpy as np
import pytest
from shapely import box

from coop_drake.drawing.solids import camera_pose


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("floor", [box(0, 0, 7, 10), box(-20, 3, 20, 6), box(0, 0, 1, 30)])
def test_every_corner_is_in_the_picture_and_the_picture_is_filled(floor, turn):
    position, target = camera_pose(floor, 0.5, turn=turn)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    up = np.cross(right, forward)
    x_min, y_min, x_max, y_max = floor.bounds
    corners = (
        np.array([[x, y, z] for x in (x_min, x_max) for y in (y_min, y_max) for z in (0.0, 0.5)]) - position
    )
    half = np.tan(np.radians(75) / 2)
    seen = (
        np.column_stack([corners @ right / (half * 4 / 3), corners @ up / half])
        / (corners @ forward)[:, None]
    )
    assert np.abs(seen).max() < 1.0
    assert np.abs(seen).max() > 0.8
