"""The harmonic map of a polygon to the unit disk, with an estimate of its error."""

from __future__ import annotations

from numpy.typing import ArrayLike
from shapely import Point, Polygon

from coop_drake.fields.accuracy import MapAccuracy
from coop_drake.fields.evaluation import evaluate_many
from coop_drake.fields.goals import region_to_map
from coop_drake.fields.outline import outline_of
from coop_drake.fields.points import as_points
from coop_drake.fields.solving import Solution, solve
from coop_drake.fields.tolerance import TOLERANCE
from coop_drake.tree.pose import FloatArray


class HarmonicMap:
    """T = (u, v), both harmonic, from a polygonal domain F to the unit disk.

    The outer ring goes to the unit circle, its angle linear in arc length; every hole collapses to one
    interior point with no net flux. A goal region collapses too: in the interior as a hole of F, on the outer
    ring to a point of the circle. T is a diffeomorphism of the interior of F, so the straight line from T(p)
    to the goal's image, pulled back, is a path from p to the goal for almost every p.

    Example:
        ```
        harmonic_map = HarmonicMap(Polygon([(0, 0), (2, 0), (2, 1), (0, 1)]), Point(1.5, 0.5))
        T, J = harmonic_map([[0.2, 0.3], [1.0, 0.5]])
        ```

    Args:
        domain: The cell, with or without holes [m].
        goal: Point to reach, or region of the domain to collapse.
        tolerance: Largest estimated error of T that is accepted.
        inside: A point of the piece to map where a goal region splits the domain.
        solution: The result of solving with these arguments before; None to solve.

    Attributes:
        region: F: the domain, less a goal region and what lies beyond it [m].
        goal: The goal as it was given [m].
        target: The shape whose image is the goal's: the goal, or its pole if it cannot collapse [m].
        solution: The result of solving.

    Raises:
        FieldError: If the domain or the goal is not usable.
        UnmappableError: If no attempt reaches the tolerance: names the corner or the gap at fault.
    """

    def __init__(
        self,
        domain: Polygon,
        goal: Point | Polygon,
        *,
        tolerance: float = TOLERANCE,
        inside: Point | None = None,
        solution: Solution | None = None,
    ) -> None:
        self.goal = goal
        self.region, self.target = region_to_map(domain, goal, inside)
        self.solution = solution or solve(outline_of(self.region, self.target), self.target, tolerance)

    def __call__(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """T and its Jacobian.

        On walls the values are the limits from inside, at vertices those of a point just inside (1e-13 of the
        legs); outside of F they are those of the nearest boundary point. They are never NaN.

        Args:
            points: Points in W, shape (..., 2) [m].

        Returns:
            T, shape (..., 2), and J = dT/dp, shape (..., 2, 2) [1/m].
        """
        p = as_points(points)
        T, J = evaluate_many(self.solution.flat, p.reshape(-1, 2) - self.solution.centre)
        return T.reshape(p.shape), J.reshape(*p.shape, 2)

    @property
    def goal_image(self) -> FloatArray:
        """q_d, the goal's image in the disk, shape (2,)."""
        return self.solution.goal_image.copy()

    @property
    def accuracy(self) -> MapAccuracy:
        """How accurate the map is, as sampled on its boundary."""
        return self.solution.accuracy
