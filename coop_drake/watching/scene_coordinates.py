"""Coordinates of the scene: the floor plan below, theta upwards, all within ten units."""

from __future__ import annotations

from math import radians

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import affine_transform

from coop_drake.drawing.camera import camera_pose
from coop_drake.geometry.swept_tree import Interval
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.theta_layers import THETA

_EXTENT = 10.0
"""Larger side of the floor [units]; the viewer's camera sees no further than a hundred."""

_TURN_BEGINS, _TURN_ENDS = 0.5, 6.5
"""Heights at which the turn of theta begins and ends [units]."""

_ELEVATION = radians(32.0)
"""How steeply the camera looks down [rad]: little enough that heights can be compared."""

_TURNED = radians(38.0)
"""How far round the camera stands, counter-clockwise, from where it looks along +y [rad]."""

_FILL = 0.8
"""Part of the picture that the scene fills; titles and player take the rest."""


class SceneCoordinates:
    """Turns metres and radians into the scene's units, whatever size the floor has.

    Args:
        floor: The workspace [m].

    Attributes:
        extent: Larger side of the floor [m].
        scale: Units per metre.
        corner: A corner of the floor where the angles are written, shape (2,) [units].
        outline: Corners of the floor's convex hull, the first one repeated, shape (k, 2) [units].
    """

    def __init__(self, floor: Polygon) -> None:
        x_min, y_min, x_max, y_max = floor.bounds
        self.extent = max(x_max - x_min, y_max - y_min)
        self.scale = scale = _EXTENT / self.extent
        self._middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max)])
        x, y = -scale * self._middle
        self._floor = affine_transform(floor, [scale, 0.0, 0.0, scale, x, y])
        self.corner: FloatArray = np.array(self._floor.bounds[:2]) - [0.03 * _EXTENT, 0.0]
        self.outline: FloatArray = shapely.get_coordinates(self._floor.convex_hull)

    def height(self, theta: float | FloatArray) -> FloatArray:
        """Return the height above the floor at which angle theta is drawn [scene units]."""
        fraction = (np.asarray(theta) - THETA[0]) / (THETA[1] - THETA[0])
        return _TURN_BEGINS + (_TURN_ENDS - _TURN_BEGINS) * fraction

    def heights(self, theta: Interval, gap: float) -> tuple[float, float]:
        """Return the heights between which an interval of theta [rad] is drawn [scene units].

        A fraction ``gap`` of the height is left open.
        """
        low, high = (float(self.height(end)) for end in theta)
        inset = 0.5 * gap * (high - low)
        return low + inset, high - inset

    def vertices(self, vertices: FloatArray) -> FloatArray:
        """Return vertices, shape (v, 3), of which x and y come in metres and heights in units, in units."""
        return np.column_stack([(vertices[:, :2] - self._middle) * self.scale, vertices[:, 2]])

    def points(self, positions: FloatArray, theta: FloatArray) -> FloatArray:
        """Return points (x, y, theta) in units; shapes (k, 2) [m] and (k,) [rad] to (k, 3)."""
        return self.vertices(np.column_stack([positions, self.height(theta)]))

    def camera(self) -> dict[str, list[float]]:
        """Return where to stand and where to look so that floor and turn just fill the picture [units]."""
        position, target = camera_pose(
            self._floor, _TURN_ENDS, elevation=_ELEVATION, turn=_TURNED, fill=_FILL
        )
        # Turned by hand, the scene turns about its middle, not about a point on its floor.
        along = (position - target) / (position - target)[2]
        middle = target + 0.4 * _TURN_ENDS * along
        return {"position": position.tolist(), "target": middle.tolist()}
