"""The velocity field that a harmonic map induces, eq. (13)."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import Point

from coop_drake.fields.evaluation import velocity_at
from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.fields.quadrature import FloatArray

__all__ = ["VelocityField"]


class VelocityField:
    """Where to go, and how fast at most: the pulled-back straight line to the goal's image, eq. (13).

    The direction is that of J^-1 (q_d - T), computed as adj(J) (q_d - T) so that crowded places do no harm.
    The speed is max_speed * min(1, distance / slowdown_radius): near the goal proportional to the remaining
    distance. It is zero in a goal region.
    Points outside the map's region get the direction of the nearest boundary point, never NaN.

    Args:
        harmonic_map: The map.
        max_speed: Largest magnitude [m/s].
        slowdown_radius: Where slowing down begins [m]; by default half the distance of a point goal to the
            boundary, or half the radius of the disc that is as large as a goal region.
    """

    def __init__(
        self, harmonic_map: HarmonicMap, max_speed: float = 1.0, *, slowdown_radius: float | None = None
    ) -> None:
        self.max_speed = float(max_speed)
        goal = harmonic_map.goal
        self._arrays, centre, self._rounding = harmonic_map.kernel_arguments
        if isinstance(goal, Point):
            corners = np.array(goal.coords) - centre
            default = 0.5 * harmonic_map.region.boundary.distance(goal)
            self._goal = np.hstack((corners, corners))
        else:
            corners = np.asarray(shapely.orient_polygons(goal).exterior.coords) - centre
            default = 0.5 * sqrt(goal.area / pi)
            self._goal = np.hstack((corners[:-1], corners[1:]))
        self.slowdown_radius = default if slowdown_radius is None else float(slowdown_radius)
        self._x, self._y = float(centre[0]), float(centre[1])
        self._image = harmonic_map.goal_image

    def __call__(self, point: ArrayLike) -> FloatArray:
        """Velocity at one point.

        Args:
            point: p in W, shape (2,) [m].

        Returns:
            Velocity in W, shape (2,) [m/s].
        """
        x, y = np.asarray(point, dtype=float).tolist()
        return velocity_at(
            self._arrays, x - self._x, y - self._y, self._rounding,
            self._goal, self._image, self.slowdown_radius, self.max_speed,
        )  # fmt: skip
