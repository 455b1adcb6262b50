"""Where things stand in the scene: floor plan below, theta upwards, all within ten units."""

from __future__ import annotations

from math import radians

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import affine_transform

from coop_drake.drawing.camera import camera_pose
from coop_drake.geometry.swept_tree import Interval
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.stack import THETA

__all__ = ["Space"]

_EXTENT = 10.0  # Units across; the viewer's camera sees no further than a hundred.
_RISE = 0.6  # Height of a whole turn as a share of the floor's larger side.
_FOOT = 0.05  # Height at which the turn begins, as another.
_ELEVATION = radians(32.0)  # How far up the camera stands: low enough that heights tell.
_TURN = radians(38.0)  # How far round from looking along +y.
_FILL = 0.8  # Part of the picture that is free of titles and player.


class Space:
    """Turns metres and radians into the scene's units, whatever size the floor has.

    Args:
        floor: The workspace [m].
    """

    def __init__(self, floor: Polygon) -> None:
        x_min, y_min, x_max, y_max = floor.bounds
        self.extent = max(x_max - x_min, y_max - y_min)
        """Larger side of the floor [m]."""
        self.scale = _EXTENT / self.extent
        """Units per metre."""
        self._middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max)])
        size, (x, y) = self.scale, -self.scale * self._middle
        self._floor = affine_transform(floor, [size, 0.0, 0.0, size, x, y])
        self._half = 0.5 * self.scale * np.array([x_max - x_min, y_max - y_min])

    def height(self, theta: float | FloatArray) -> FloatArray:
        """Height over the floor of an angle on the turn drawn [units]."""
        share = (np.asarray(theta) - THETA[0]) / (THETA[1] - THETA[0])
        return _EXTENT * (_FOOT + _RISE * share)

    def layer(self, theta: Interval, gap: float) -> tuple[float, float]:
        """Heights between which an interval of theta is drawn; ``gap`` is the share left open [units]."""
        low, high = (float(self.height(end)) for end in theta)
        inset = 0.5 * gap * (high - low)
        return low + inset, high - inset

    def flat(self, vertices: FloatArray) -> FloatArray:
        """Vertices with x and y in metres and heights in units, all in units; shape (v, 3)."""
        return np.column_stack([(vertices[:, :2] - self._middle) * self.scale, vertices[:, 2]])

    def points(self, positions: FloatArray, theta: FloatArray) -> FloatArray:
        """Points (x, y, theta) in units; shapes (k, 2) [m] and (k,) [rad] to (k, 3)."""
        return self.flat(np.column_stack([positions, self.height(theta)]))

    def corner(self) -> FloatArray:
        """A corner of the floor where the angles are written, shape (2,) [units]."""
        return np.array([-self._half[0] - 0.03 * _EXTENT, -self._half[1]])

    def outline(self) -> FloatArray:
        """Corners of the floor's convex hull, the first one repeated at the end, shape (k, 2) [units]."""
        outline: FloatArray = shapely.get_coordinates(self._floor.convex_hull)
        return outline

    def camera(self) -> dict[str, list[float]]:
        """Where to stand and where to look so that floor and stack just fill the picture [units]."""
        top = float(self.height(THETA[1]))
        position, target = camera_pose(self._floor, top, elevation=_ELEVATION, turn=_TURN, fill=_FILL)
        # Turned by hand, the scene turns about its middle, not about a point on its floor.
        along = (position - target) / (position - target)[2]
        middle = target + 0.4 * top * along
        return {"position": position.tolist(), "target": middle.tolist()}
