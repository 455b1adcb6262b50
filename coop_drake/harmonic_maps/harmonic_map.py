"""The harmonic map of a polygon to the unit disk, solved to a tolerance, with an estimate of its error."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike
from shapely import Point, Polygon

from coop_drake.errors import UnmappableError
from coop_drake.harmonic_maps import TOLERANCE
from coop_drake.harmonic_maps.assemble import pack_layers
from coop_drake.harmonic_maps.evaluate import FlatMap, MapArrays, evaluate_many, flatten, unflatten
from coop_drake.harmonic_maps.outline import Outline, as_points, outline_of, region_to_map
from coop_drake.harmonic_maps.panels import Panels, lay_panels, leg_panels
from coop_drake.harmonic_maps.solve import solve_density
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray

_GAIN = 4.0
"""Factor by which the error falls with every further node on a panel, approximately [-]."""
_PROGRESS = 0.7
"""An attempt that leaves more than this fraction of the error is the last: more nodes would not help either
[-]."""
_LARGE = 2_000
"""Unknowns from which the first attempt, which rarely suffices then, is left out."""
_EPSILON = float(np.finfo(float).eps)
_MAX_UNKNOWNS = 40_000
"""Largest system that is solved: it takes about 7 s and 700 MB."""
#: Chebyshev points [-]: denser than the nodes of a panel, and different from them.
_ON_PANEL = np.sort(np.cos(np.pi * (np.arange(23) + 0.5) / 23))
_ON_RING = np.cos(np.pi * (np.arange(5) + 0.5) / 5)
_NARROW = 0.01
"""Width of a gap, per length of the walls of the corner beside it, below which the gap is at fault [-]."""
_RINGS = np.array([0, 1, 2, 3, 5, 8, 13, 21, 33])
"""Dyadic rings of a corner on which the residual is sampled: down to 1e-10 of its legs."""


@dataclass(frozen=True)
class MapAccuracy:
    """How far a computed map is from the true one, as samples of its boundary say.

    The error is harmonic, has no flux around any hole, and on every hole it is a constant up to the residual.
    With M holes it is nowhere larger than (2 M + 1) times the largest residual of all boundary points. The
    largest one of the samples stands for that, so that the result is an estimate, not a bound.

    Attributes:
        residual: Largest distance of the image of a boundary sample from where it belongs.
        error_estimate: (2 M + 1) times that.
        samples: Number of boundary samples.
        unknowns: Size of the linear system.
        condition: Estimate of its condition in the 1-norm.
        worst_place: Where the residual is largest, in W [m], shape (2,).
        worst_place_description: The corner or gap there, in words.
        worst_angle: Interior angle of the corner there [degrees], None at a gap.
        worst_gap: Width of the gap there [m], None at a corner.
    """

    residual: float
    error_estimate: float
    samples: int
    unknowns: int
    condition: float
    worst_place: FloatArray
    worst_place_description: str
    worst_angle: float | None = None
    worst_gap: float | None = None

    def plain(self) -> dict[str, Any]:
        """The values by name, for JSON."""
        values = asdict(self)
        return values | {"worst_place": values["worst_place"].tolist()}


class _Attempt(NamedTuple):
    """A resolution: Gauss nodes on a panel, and longest panel per unit of distance (`leg_panels`)."""

    nodes: int
    closeness: float


# Ten nodes suffice for most domains, thirteen for most large ones.
_FEWEST = _Attempt(10, 1.5)
_ATTEMPTS = (_FEWEST, _Attempt(13, 1.5), _Attempt(16, 1.5), _Attempt(16, 1.0), _Attempt(20, 0.7))


class Solution(NamedTuple):
    """The result of solving: everything that evaluates a map, as plain arrays and numbers.

    Attributes:
        flat: The map for compiled code, see `flat_map`.
        goal_image: q_d, the goal's image in the disk, shape (2,).
        accuracy: How far the map is estimated to be from the true one.
    """

    flat: FlatMap
    goal_image: FloatArray
    accuracy: MapAccuracy

    @property
    def arrays(self) -> MapArrays:
        """The arrays of the map by their names."""
        return unflatten(self.flat)

    @property
    def centre(self) -> FloatArray:
        """Origin of the map's coordinates in W [m], shape (2,)."""
        return self.flat[:2]


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
        self.solution = solution or _solve(outline_of(self.region, self.target), self.target, tolerance)

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


def _solve(outline: Outline, goal: Point | Polygon, tolerance: float) -> Solution:
    """Solve with more and more nodes until the estimated error is within the tolerance.

    The image of the goal, the target, is looked up if it is a point.

    Raises:
        UnmappableError: If more nodes do not reduce the error, or would be too many, or the system is so
            close to singular, as narrow gaps make it, that rounding alone may exceed the tolerance.
    """
    best: MapAccuracy | None = None
    last = _FEWEST
    for attempt in _ATTEMPTS:
        if best is not None and not _is_promising(attempt, last, best.error_estimate / tolerance):
            continue
        panels = lay_panels(outline, attempt.closeness)
        unknowns = _unknowns(outline, panels, attempt)
        if attempt == _FEWEST and _LARGE <= unknowns <= _MAX_UNKNOWNS:
            continue
        if unknowns > _MAX_UNKNOWNS:
            _refuse(best, tolerance, outline, panels, unknowns)
        solution = _attempt(outline, goal, panels, attempt)
        bound = solution.accuracy.error_estimate
        if bound <= tolerance:
            return solution
        if best is not None and bound > _PROGRESS * best.error_estimate:
            break
        best, last = solution.accuracy, attempt
        if _EPSILON * best.condition > tolerance:  # more nodes do not reduce rounding errors
            break
    _refuse(best, tolerance, outline, panels, unknowns)


def _is_promising(attempt: _Attempt, last: _Attempt, excess: float) -> bool:
    """Whether an attempt may reduce the error by a factor; the last one of a closeness is always made."""
    final = max(other.nodes for other in _ATTEMPTS if other.closeness == attempt.closeness)
    gain = _GAIN ** (attempt.nodes - last.nodes)
    return attempt.closeness != last.closeness or attempt.nodes == final or gain >= excess


def _angles(outline: Outline) -> FloatArray:
    """Angles of the corners [rad], rounded to 1e-12 so that equal corners share one operator in the cache."""
    return np.round(outline.corner_angles, 12)


def _unknowns(outline: Outline, panels: Panels, attempt: _Attempt) -> int:
    """Size of the linear system without the holes' images."""
    legs = sum(2 * len(leg_panels(float(angle), attempt.closeness)[0]) - 2 for angle in _angles(outline))
    return attempt.nodes * (len(panels.edge) + legs)


def _attempt(outline: Outline, goal: Point | Polygon, panels: Panels, attempt: _Attempt) -> Solution:
    """Make one attempt."""
    angles = _angles(outline)
    centre = np.array([outline.centre.real, outline.centre.imag])
    # Coordinates of points are rounded: a point outside by less than this counts as on the wall.
    rounding = 8.0 * _EPSILON * (abs(outline.centre) + outline.diameter)
    density = solve_density(outline, panels, angles, *attempt)
    arrays = pack_layers(outline, panels, angles, density, attempt.closeness)
    flat = flatten(arrays, centre, rounding)
    unknowns = len(density.weighted) + outline.holes
    accuracy = _estimate_accuracy(outline, panels, flat, density.hole_images, unknowns, density.condition)
    return Solution(flat, _goal_image(outline, goal, density.hole_images, flat), accuracy)


def _goal_image(
    outline: Outline, goal: Point | Polygon, hole_images: FloatArray, flat: FlatMap
) -> FloatArray:
    """Image of the goal: a point of the circle, a hole's image, or the image of a point, shape (2,)."""
    image: FloatArray
    if outline.goal_angle is not None:
        return np.array([np.cos(outline.goal_angle), np.sin(outline.goal_angle)])
    if outline.goal_ring is not None:
        image = hole_images[outline.goal_ring - 1].copy()
    else:
        images, _ = evaluate_many(flat, np.array(goal.coords)[:, :2] - flat[:2])
        image = images[0]
    return image


def _refuse(
    best: MapAccuracy | None, tolerance: float, outline: Outline, panels: Panels, unknowns: int
) -> NoReturn:
    """Raise an error with the place where the best attempt is worst, or the narrowest gap without one."""
    if best is not None:
        rounding = _EPSILON * best.condition
        why = f", and rounding alone may cost {rounding:.2g}" if rounding > tolerance else ""
        raise UnmappableError(
            f"the harmonic map is accurate to about {best.error_estimate:.2g}; {tolerance:.2g} was asked for"
            f"{why}; at fault is {best.worst_place_description}",
            (float(best.worst_place[0]), float(best.worst_place[1])),
            angle=best.worst_angle,
            width=best.worst_gap,
        )
    k = int(np.argmin(panels.gap))
    edge = int(panels.edge[k])
    tangent = (outline.ends - outline.vertices)[edge]
    place = outline.vertices[edge] + 0.5 * (panels.start + panels.end)[k] * tangent / abs(tangent)
    fault = _find_fault(outline, panels, place, edge)
    where = place + outline.centre
    raise UnmappableError(
        f"the harmonic map would take {unknowns} unknowns, at most {_MAX_UNKNOWNS} are allowed; narrowest is "
        + fault.description,
        (where.real, where.imag),
        angle=fault.angle,
        width=fault.gap,
    )


class _Fault(NamedTuple):
    """A corner or a gap that limits the accuracy.

    Attributes:
        description: Its name.
        angle: Interior angle of the corner [degrees], None for a gap.
        gap: Width of the gap [m], None for a corner.
    """

    description: str
    angle: float | None
    gap: float | None


def _estimate_accuracy(
    outline: Outline, panels: Panels, flat: FlatMap, hole_images: FloatArray, unknowns: int, condition: float
) -> MapAccuracy:
    """Sample the residual on every panel and far down every corner of a map, evaluated as its users do.

    The images of the holes, c_k, have shape (holes, 2); the size of the linear system and its condition are
    reported as they are given.
    """
    position, expected, edge = _samples(outline, panels, hole_images)
    vertices = np.minimum(np.abs(position - outline.vertices[edge]), np.abs(position - outline.ends[edge]))
    clear = vertices > 100.0 * flat[2]  # rounding would move closer samples across the other wall
    position, expected, edge = position[clear], expected[clear], edge[clear]
    images, _ = evaluate_many(flat, np.column_stack((position.real, position.imag)))
    residuals = np.abs(images[:, 0] + 1j * images[:, 1] - expected)
    residuals = np.where(np.isfinite(residuals), residuals, np.inf)
    worst = int(np.argmax(residuals))
    place = position[worst] + outline.centre
    fault = _find_fault(outline, panels, position[worst], int(edge[worst]))
    return MapAccuracy(
        residual=float(residuals[worst]),
        error_estimate=float((2 * outline.holes + 1) * residuals[worst]),
        samples=len(position),
        unknowns=unknowns,
        condition=condition,
        worst_place=np.array([place.real, place.imag]),
        worst_place_description=fault.description,
        worst_angle=fault.angle,
        worst_gap=fault.gap,
    )


def _samples(
    outline: Outline, panels: Panels, hole_images: FloatArray
) -> tuple[ComplexArray, ComplexArray, IntArray]:
    """Positions, where the map should send them, and their edges."""
    length = np.abs(outline.ends - outline.vertices)
    half = 0.5 * (panels.end - panels.start)[:, None]
    on_panels = (0.5 * (panels.end + panels.start)[:, None] + half * _ON_PANEL).ravel()
    depth = ((0.75 + 0.25 * _ON_RING) * 0.5 ** _RINGS[:, None]).ravel()
    legs = (panels.legs[:, None] * depth).ravel()
    corners = np.repeat(np.arange(len(length)), depth.size)
    before = outline.preceding[corners]
    edge = np.concatenate((np.repeat(panels.edge, _ON_PANEL.size), corners, before)).astype(np.int64)
    s = np.concatenate((on_panels, legs, length[before] - legs))
    part = s / length[edge]
    angle = outline.angle_start[edge] + (outline.angle_end - outline.angle_start)[edge] * part
    ring = outline.ring[edge]
    constants = np.concatenate(([0.0], hole_images @ np.array([1.0, 1.0j])))
    expected = np.where(ring == 0, np.exp(1j * angle), constants[ring])
    return outline.vertices[edge] + (outline.ends - outline.vertices)[edge] * part, expected, edge


def _find_fault(outline: Outline, panels: Panels, place: complex, edge: int) -> _Fault:
    """Name the corner or the gap at a place of the boundary."""
    for vertex in (edge, int(outline.following[edge])):
        if abs(place - outline.vertices[vertex]) <= 1.5 * panels.legs[vertex]:
            return _fault_at_corner(outline, vertex)
    along = abs(place - outline.vertices[edge])
    own = np.flatnonzero(panels.edge == edge)
    nearest = own[np.argmin(np.abs(0.5 * (panels.start + panels.end)[own] - along))]
    return _gap_of(float(panels.gap[nearest]), place + outline.centre)


def _fault_at_corner(outline: Outline, vertex: int) -> _Fault:
    """The corner, or a gap between it and another wall that is far narrower than its own walls are long."""
    place, starts, ends = outline.vertices[vertex], outline.vertices, outline.ends
    along = np.clip(np.real((place - starts) / (ends - starts)), 0.0, 1.0)
    distance = np.abs(starts + along * (ends - starts) - place)
    own = [int(outline.preceding[vertex]), vertex]
    gap = float(np.delete(distance, own).min(initial=np.inf))
    where = place + outline.centre
    if gap < _NARROW * np.abs(ends - starts)[own].min():
        return _gap_of(gap, where)
    angle = float(np.rad2deg(outline.corner_angles[vertex]))
    corner = f"the corner at ({where.real:.6g}, {where.imag:.6g}) m"
    return _Fault(f"{corner} with interior angle {angle:.4g} degrees", angle, None)


def _gap_of(width: float, where: complex) -> _Fault:
    return _Fault(f"the gap of {width:.3g} m at ({where.real:.6g}, {where.imag:.6g}) m", None, width)
