"""The velocity field that a harmonic map induces, eq. (13)."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike
from shapely import Point

from coop_drake.fields.certainty import check_certainty
from coop_drake.fields.flat_field import flat_field, velocities_in_field
from coop_drake.fields.flat_map import FlatMap
from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.fields.points import as_points
from coop_drake.geometry.boundary import edges_of
from coop_drake.tree.pose import FloatArray


class VelocityField:
    """The velocity along the pulled-back straight line to the goal's image, eq. (13).

    The direction is that of J^-1 (q_d - T), computed as adj(J) (q_d - T) which needs no inverse where J is
    nearly singular. The speed is max_speed * min(1, distance / slowdown_radius): at most max_speed
    everywhere, near the goal proportional to the remaining distance, zero in a goal region.

    The image of a streamline is a straight line to q_d, so the streamline never reaches a wall, and from
    almost everywhere it arrives. The field is smooth in the interior except at the goal's edge, where the
    speed has a kink. It is not Lipschitz near a vertex that juts into the domain: the direction turns around
    it within any distance, however small. At most two streamlines end on a hole that collapses, and those
    beside them are slow there.
    Points outside the map's region get the direction of the nearest boundary point, never NaN.

    Args:
        harmonic_map: The map.
        max_speed: Largest magnitude [m/s].
        slowdown_radius: Where slowing down begins [m]; by default half the distance of a point goal to the
            boundary, or half the radius of the disc that is as large as a goal region.

    Raises:
        FieldError: If the map's error leaves the direction open in more than a hundredth of the region.
    """

    def __init__(
        self, harmonic_map: HarmonicMap, max_speed: float = 1.0, *, slowdown_radius: float | None = None
    ) -> None:
        check_certainty(harmonic_map)
        self.harmonic_map = harmonic_map
        self.max_speed = float(max_speed)
        goal, solution = harmonic_map.goal, harmonic_map.solution
        if isinstance(goal, Point):
            default = 0.5 * harmonic_map.region.boundary.distance(goal)
            edges = np.tile(np.array(goal.coords)[:, :2], 2)
        else:
            default = 0.5 * sqrt(goal.area / pi)
            edges = edges_of(goal)
        self.slowdown_radius = default if slowdown_radius is None else float(slowdown_radius)
        around = edges - np.tile(solution.centre, 2)
        self._map = solution.flat
        self._field = flat_field(around, solution.goal_image, self.slowdown_radius, self.max_speed)

    def __call__(self, points: ArrayLike) -> FloatArray:
        """Velocity in W at one point or at many, shape (..., 2) [m] to (..., 2) [m/s].

        Raises:
            FieldError: If the points have another shape or are not finite.
        """
        p = as_points(points)
        return velocities_in_field(self._map, self._field, p.reshape(-1, 2)).reshape(p.shape)

    @property
    def kernel_arguments(self) -> tuple[FlatMap, FloatArray]:
        """The first two arguments of `velocity_in_field`, for compiled code that evaluates the field."""
        return self._map, self._field
