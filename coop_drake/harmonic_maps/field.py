"""The velocity field that a harmonic map induces, eq. (13), its certainty and its streamlines."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import Point

from coop_drake.errors import FieldError
from coop_drake.geometry.polygons import edges_of, extent_of
from coop_drake.harmonic_maps.evaluate import FlatMap, among_walls, evaluate_one
from coop_drake.harmonic_maps.harmonic_map import HarmonicMap, as_points
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

_STRAIGHT = 1e-6
"""Fraction of the slowdown radius within which the way to a point goal is taken as straight: closer still,
the difference of the images is mostly rounding [-]."""
_EDGES = 4
"""Numbers in a flat field before the goal's edges: slowdown radius, largest speed, the goal's image."""
_UNCERTAIN = 0.1
"""Sine of the error above which a direction counts as unknown: six degrees [-]."""
_MOST = 0.01
"""Largest fraction of the region where the direction may be unknown [-]."""
_ASIDE = 0.25
"""Distance by which a sample at the goal, which has no direction, is moved, in sizes of its leaf [-]."""
_LEAST_DISTANCE = 0.1
"""Smallest distance from the walls at which a leaf's sample is judged, in sizes of the leaf [-]."""
_TURN = 0.2
"""Largest turn of the direction within a step [rad]."""
_LONGEST = 0.05
"""Longest step, per size of the region [-]."""
_FIRST = 1e-3
"""First step, per size of the region [-]."""
_GROWTH = 1.6
"""Growth of the next step where the direction hardly turns [-]."""
_ARRIVED = 0.01
"""Distance from the goal at which a streamline has arrived, per slowdown radius [-]."""


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
        _check_certainty(harmonic_map)
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
        first = [self.slowdown_radius, self.max_speed]
        self._field = np.concatenate((first, solution.goal_image, around.reshape(-1)))

    def __call__(self, points: ArrayLike) -> FloatArray:
        """Velocity in W at one point or at many, shape (..., 2) [m] to (..., 2) [m/s].

        Raises:
            FieldError: If the points have another shape or are not finite.
        """
        p = as_points(points)
        known, places = self.kernel_arguments, p.reshape(-1, 2).tolist()
        return np.array([velocity_in_field(*known, x, y) for x, y in places]).reshape(p.shape)

    @property
    def kernel_arguments(self) -> tuple[FlatMap, FloatArray]:
        """The first two arguments of `velocity_in_field`, for compiled code that evaluates the field."""
        return self._map, self._field


@compiled(borrows=True)
def velocity_in_field(flat: FlatMap, field: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Velocity at a point of W [m], eq. (13) [m/s].

    The first two arguments are `VelocityField.kernel_arguments`: the map, and what the field adds to it,
    which is the slowdown radius [m], the largest speed [m/s], the goal's image, and the goal's edges as rows
    (x0, y0, x1, y1) relative to the map's centre [m]; for a point, one edge of no length.
    """
    x, y = x - flat[0], y - flat[1]
    radius, max_speed, edges = field[0], field[1], (len(field) - _EDGES) // 4
    arrived, gx, gy = among_walls(field, _EDGES, edges, x, y)
    remaining = np.sqrt((gx - x) ** 2 + (gy - y) ** 2)
    if remaining == 0.0 or arrived:
        return 0.0, 0.0
    if edges == 1 and remaining < _STRAIGHT * radius:
        dx, dy = gx - x, gy - y
    else:
        u, v, u_x, u_y, v_x, v_y = evaluate_one(flat, x, y)
        du, dv = field[2] - u, field[3] - v
        dx, dy = v_y * du - u_y * dv, u_x * dv - v_x * du
    norm = np.hypot(dx, dy)
    if norm == 0.0:
        return 0.0, 0.0
    speed = max_speed * min(1.0, remaining / radius)
    return speed * dx / norm, speed * dy / norm


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


def _check_certainty(harmonic_map: HarmonicMap) -> None:
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


@dataclass(frozen=True)
class Streamlines:
    """Streamlines of a velocity field and their travel times.

    Attributes:
        paths: For each start its streamline, shape (points, 2) [m].
        times: Time until each is within a hundredth of the slowdown radius of the goal, infinite if it does
            not get there, shape (n,) [s].
    """

    paths: tuple[FloatArray, ...]
    times: FloatArray

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether each start arrives, shape (n,)."""
        return np.isfinite(self.times)


def trace_streamlines(field: VelocityField, starts: ArrayLike, *, max_steps: int = 2_000) -> Streamlines:
    """Follow a field from many starts by Heun's rule, with steps in which its direction hardly turns.

    A step that would leave the region or turn too much is tried again at half its length.

    Args:
        field: The field.
        starts: Points in the map's region, shape (n, 2) [m].
        max_steps: Attempted steps after which a streamline counts as not arriving.

    Raises:
        FieldError: If the starts have another shape or are not finite.
    """
    here = as_points(starts).reshape(-1, 2).copy()
    goal, region = field.harmonic_map.goal, field.harmonic_map.region
    size, close = extent_of(region), _ARRIVED * field.slowdown_radius
    times, reach = np.zeros(len(here)), np.full(len(here), _FIRST * size)
    going = np.flatnonzero(shapely.distance(goal, shapely.points(here)) > close)
    history = [(np.arange(len(here)), here.copy())]
    shapely.prepare(region)
    for _ in range(max_steps):
        if not len(going):
            break
        p = here[going]
        left = np.asarray(shapely.distance(goal, shapely.points(p)))
        step = np.minimum(reach[going], np.where(left > 2.0 * close, 0.5 * left, left - 0.99 * close))
        first = field(p)
        second = field(p + step[:, None] * _unit(first))
        after = p + 0.5 * step[:, None] * (_unit(first) + _unit(second))
        turn = np.linalg.norm(_unit(second) - _unit(first), axis=1)
        chords = shapely.linestrings(np.stack((p, after), axis=1))
        good = (turn < _TURN) & shapely.covers(region, chords)
        moved = going[good]
        here[moved] = after[good]
        times[moved] += (step * _slowness(first, second))[good]
        history.append((moved, after[good]))
        growth = np.where(good, np.where(turn < 0.5 * _TURN, _GROWTH, 1.0), 0.5)
        reach[going] = np.minimum(step * growth, _LONGEST * size)
        going = going[~good | (shapely.distance(goal, shapely.points(here[going])) > close)]
    times[going] = np.inf
    return Streamlines(_paths(history, len(here)), times)


def _paths(history: list[tuple[NDArray[np.intp], FloatArray]], count: int) -> tuple[FloatArray, ...]:
    """Points of each streamline in order, from the steps of all of them."""
    owner = np.concatenate([moved for moved, _ in history])
    points = np.concatenate([places for _, places in history])
    order = np.argsort(owner, kind="stable")
    ends = np.cumsum(np.bincount(owner, minlength=count))[:-1]
    return tuple(np.split(points[order], ends))


def _unit(vectors: FloatArray) -> FloatArray:
    """Directions of vectors (n, 2); zero stays zero."""
    lengths = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return np.asarray(vectors / lengths)


def _slowness(first: FloatArray, second: FloatArray) -> FloatArray:
    """Mean of 1 / speed between two points by Simpson's rule (n,) [s/m]."""
    before, after = (np.maximum(np.linalg.norm(v, axis=1), 1e-300) for v in (first, second))
    return np.asarray((1.0 / before + 8.0 / (before + after) + 1.0 / after) / 6.0)
