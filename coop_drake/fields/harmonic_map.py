"""The harmonic map of a polygon to the unit disk, certified."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from shapely import Point, Polygon

from coop_drake.errors import FieldError
from coop_drake.fields.certificate import MapCertificate, certify, describe_place
from coop_drake.fields.corners import leg_panels
from coop_drake.fields.density import solve_density
from coop_drake.fields.evaluation import evaluate_many
from coop_drake.fields.goals import region_to_map
from coop_drake.fields.layers import MapArrays, pack_layers
from coop_drake.fields.outline import Outline, outline_of
from coop_drake.fields.panels import Panels, lay_panels
from coop_drake.fields.points import as_points
from coop_drake.fields.quadrature import FloatArray

__all__ = ["HarmonicMap", "Solution"]

_ATTEMPTS = ((10, 1.5), (12, 1.5), (16, 1.0), (16, 0.5))  # nodes a panel, longest panel per distance
_FEWER = (8, 1.5)  # before these, where ten nodes a panel take seconds
_MANY_UNKNOWNS = 4_000
_MAX_UNKNOWNS = 9_000  # 0.7 GB and some ten seconds


class Solution(NamedTuple):
    """What solving leaves behind: all that evaluating a map takes, as plain arrays and numbers.

    Attributes:
        arrays: The layers, for the kernels that evaluate them.
        centre: Origin of their coordinates in W [m], shape (2,).
        rounding: How far outside still counts as on the wall [m].
        goal_image: q_d, the goal's image in the disk, shape (2,).
        certificate: How far the map can be from the true one.
    """

    arrays: MapArrays
    centre: FloatArray
    rounding: float
    goal_image: FloatArray
    certificate: MapCertificate


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
        tolerance: Largest error of T that is accepted, as certified.
        inside: A point of the piece to map where a goal region splits the domain.

    Raises:
        FieldError: If the domain or the goal is not usable, or no attempt reaches the tolerance: the message
            names the corner or the gap at fault.
    """

    def __init__(
        self,
        domain: Polygon,
        goal: Point | Polygon,
        *,
        tolerance: float = 1e-4,
        inside: Point | None = None,
    ) -> None:
        self._goal = goal
        self._region, self._target = region_to_map(domain, goal, inside)
        self._solution = _solve(outline_of(self._region, self._target), self._target, tolerance)

    @classmethod
    def from_solution(
        cls, domain: Polygon, goal: Point | Polygon, solution: Solution, *, inside: Point | None = None
    ) -> HarmonicMap:
        """The map that was solved before with these arguments, without solving it again."""
        harmonic_map = cls.__new__(cls)
        harmonic_map._goal = goal
        harmonic_map._region, harmonic_map._target = region_to_map(domain, goal, inside)
        harmonic_map._solution = solution
        return harmonic_map

    def __call__(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """T and its Jacobian.

        On walls the values are the limits from inside, at vertices those a hair inside; outside of F those of
        the nearest boundary point. Nothing is ever NaN.

        Args:
            points: Points in W, shape (..., 2) [m].

        Returns:
            T, shape (..., 2), and J = dT/dp, shape (..., 2, 2) [1/m].
        """
        p = as_points(points)
        flat = np.ascontiguousarray(p.reshape(-1, 2) - self._solution.centre)
        T, J = evaluate_many(self._solution.arrays, flat, self._solution.rounding)
        return T.reshape(p.shape), J.reshape(*p.shape, 2)

    @property
    def region(self) -> Polygon:
        """F: the domain, less a goal region and what lies beyond it [m]."""
        return self._region

    @property
    def goal(self) -> Point | Polygon:
        """The goal as it was given [m]."""
        return self._goal

    @property
    def target(self) -> Point | Polygon:
        """What goes to the goal's image: the goal, or the pole of a goal region that cannot collapse [m]."""
        return self._target

    @property
    def goal_image(self) -> FloatArray:
        """q_d, the goal's image in the disk, shape (2,)."""
        return self._solution.goal_image.copy()

    @property
    def certificate(self) -> MapCertificate:
        """How far the map can be from the true one."""
        return self._solution.certificate

    @property
    def solution(self) -> Solution:
        """What solving left behind, see `from_solution`."""
        return self._solution

    @property
    def kernel_arguments(self) -> tuple[MapArrays, FloatArray, float]:
        """Arrays, centre (2,) in W [m] and rounding [m], for kernels that evaluate the map themselves."""
        return self._solution[:3]


def _solve(outline: Outline, goal: Point | Polygon, tolerance: float) -> Solution:
    """Solve with more and more nodes until the certificate is good enough."""
    centre = np.array([outline.centre.real, outline.centre.imag])
    # Coordinates come rounded: what lies outside by less than this counts as on the wall.
    rounding = 8.0 * float(np.finfo(float).eps) * (abs(outline.centre) + outline.diameter)
    # Corner operators are cached by angle: rounded angles hit the cache and change nothing beyond rounding.
    angles = np.round(outline.corner_angles, 12)
    best: MapCertificate | None = None
    for nodes, closeness in (_FEWER, *_ATTEMPTS):
        panels = lay_panels(outline, closeness)
        unknowns = nodes * (
            len(panels.edge) + sum(2 * len(leg_panels(float(a), closeness)[0]) - 2 for a in angles)
        )
        if (nodes, closeness) == _FEWER and unknowns < _MANY_UNKNOWNS:
            continue
        if unknowns > _MAX_UNKNOWNS:
            best = best or _refuse_size(outline, panels, unknowns)
            break
        density = solve_density(outline, panels, angles, nodes, closeness)
        arrays = pack_layers(outline, panels, angles, density, closeness)
        certificate = certify(outline, panels, arrays, density.hole_images, density.condition, rounding)
        if certificate.error_bound <= tolerance:
            image = _goal_image(outline, goal, density.hole_images, arrays, rounding)
            return Solution(arrays, centre, rounding, image, certificate)
        if best is None or certificate.error_bound < best.error_bound:
            best = certificate
    assert best is not None
    raise FieldError(
        f"the harmonic map is certified to {best.error_bound:.2g} only, {tolerance:.2g} was asked for; "
        f"at fault is {best.worst_place_description}"
    )


def _goal_image(
    outline: Outline, goal: Point | Polygon, hole_images: FloatArray, arrays: MapArrays, rounding: float
) -> FloatArray:
    """Where the goal goes: a point of the circle, a hole's image, or the image of a point."""
    image: FloatArray
    if outline.goal_angle is not None:
        return np.array([np.cos(outline.goal_angle), np.sin(outline.goal_angle)])
    if outline.goal_ring is not None:
        image = hole_images[outline.goal_ring - 1].copy()
        return image
    point = np.array(goal.coords) - [outline.centre.real, outline.centre.imag]
    images, _ = evaluate_many(arrays, point, rounding)
    image = images[0]
    return image


def _refuse_size(outline: Outline, panels: Panels, unknowns: int) -> MapCertificate:
    """Stop before a system that would not fit, naming the narrowest gap.

    Raises:
        FieldError: Always.
    """
    k = int(np.argmin(panels.gap))
    edge = int(panels.edge[k])
    tangent = (outline.ends - outline.vertices)[edge]
    place = outline.vertices[edge] + 0.5 * (panels.start + panels.end)[k] * tangent / abs(tangent)
    raise FieldError(
        f"the harmonic map would take {unknowns} unknowns, at most {_MAX_UNKNOWNS} are allowed; narrowest is "
        + describe_place(outline, panels, place, edge)
    )
