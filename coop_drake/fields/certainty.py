"""Estimates the error of a velocity field's direction, which grows where the Jacobian is nearly singular."""

from __future__ import annotations

from math import pi

import numpy as np
import shapely

from coop_drake.errors import FieldError
from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.tree.pose import FloatArray

_UNCERTAIN = 0.1
"""Sine of the error above which a direction counts as unknown: six degrees [-]."""
_MOST = 0.01
"""Largest fraction of the region where the direction may be unknown [-]."""
_ASIDE = 0.25
"""Distance by which a sample at the goal, which has no direction, is moved, in sizes of its leaf [-]."""
_LEAST_DISTANCE = 0.1
"""Smallest distance from the walls at which a leaf's sample is judged, in sizes of the leaf [-]."""


def direction_error(harmonic_map: HarmonicMap, points: FloatArray, distance: FloatArray) -> FloatArray:
    """Estimate the largest error of the direction of adj(J) (q_d - T).

    The error of T is harmonic, and so is each of its components, along whatever axis; none is above e, for
    which the estimate stands. So the error of J is at most 4 e / (pi r) in the spectral norm at a distance r
    from the boundary, that of q_d - T at most 2 e, and in the plane adj(J) has the norm of J.

    Args:
        harmonic_map: The map.
        points: Points inside its region, shape (n, 2) [m].
        distance: Their distances r, or less, from the boundary, shape (n,) [m].

    Returns:
        Sines of the largest angles between true and computed direction, shape (n,) [-]; 1 and more say
        that the direction is not known at all.
    """
    T, J = harmonic_map(points)
    line = harmonic_map.goal_image - T
    x = J[:, 1, 1] * line[:, 0] - J[:, 0, 1] * line[:, 1]
    y = J[:, 0, 0] * line[:, 1] - J[:, 1, 0] * line[:, 0]
    error = harmonic_map.accuracy.error_estimate
    of_J, of_line = 4.0 * error / (pi * np.maximum(distance, 1e-300)), 2.0 * error
    lost = of_J * (np.hypot(*line.T) + of_line) + np.linalg.norm(J, axis=(1, 2)) * of_line
    return np.asarray(lost / np.maximum(np.hypot(x, y), 1e-300))


def check_certainty(harmonic_map: HarmonicMap) -> None:
    """Refuse a map whose error leaves the field's direction undetermined in more than 1 % of the region.

    This happens in long, narrow aisles between two holes when the images of the holes and of the goal lie in
    one line: the Jacobian's determinant is then about exp(-pi length / width), less than the map's error.
    The direction is tested at the centres of the squares of the map's quadtree, which are smaller near walls.

    Raises:
        FieldError: With the part of the region and the place there that is farthest from walls.
    """
    leaves = harmonic_map.solution.arrays.leaf_square
    centres, sizes = leaves[:, :2] + harmonic_map.solution.centre, leaves[:, 2]
    inside = shapely.contains_xy(harmonic_map.region, *centres.T)
    centres, sizes = centres[inside], sizes[inside]
    # At the goal there is no direction: its leaf is judged beside it.
    at_goal = shapely.distance(harmonic_map.goal, shapely.points(centres)) < _LEAST_DISTANCE * sizes
    centres[at_goal] += _ASIDE * sizes[at_goal, None]
    distance = shapely.distance(harmonic_map.region.boundary, shapely.points(centres))
    unknown = (
        direction_error(harmonic_map, centres, np.maximum(distance, _LEAST_DISTANCE * sizes)) > _UNCERTAIN
    )
    part = float((sizes * sizes)[unknown].sum() / (sizes * sizes).sum())
    if part > _MOST:
        x, y = centres[np.argmax(np.where(unknown, distance, -1.0))]
        raise FieldError(
            f"the direction of the field is not known in {100.0 * part:.2g} % of the region, for example at "
            f"({x:.6g}, {y:.6g}) m: there the Jacobian's determinant is below the map's error; "
            "join the holes to the outer ring, move the goal, or ask for a smaller tolerance"
        )
