"""Solves the map of one outline with as many nodes as its tolerance needs, or names the obstacle."""

from __future__ import annotations

from typing import NamedTuple, NoReturn

import numpy as np
from shapely import Point, Polygon

from coop_drake.errors import UnmappableError
from coop_drake.fields.accuracy import MapAccuracy, estimate_accuracy, find_fault
from coop_drake.fields.corners import leg_panels
from coop_drake.fields.density import solve_density
from coop_drake.fields.evaluation import evaluate_many
from coop_drake.fields.flat_map import FlatMap, MapArrays, flatten, unflatten
from coop_drake.fields.outline import Outline
from coop_drake.fields.packing import pack_layers
from coop_drake.fields.panels import Panels, lay_panels
from coop_drake.tree.pose import FloatArray

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


class Attempt(NamedTuple):
    """A resolution: Gauss nodes on a panel, and longest panel per unit of distance (`leg_panels`)."""

    nodes: int
    closeness: float


# Ten nodes suffice for most domains, thirteen for most large ones.
_FEWEST = Attempt(10, 1.5)
_ATTEMPTS = (_FEWEST, Attempt(13, 1.5), Attempt(16, 1.5), Attempt(16, 1.0), Attempt(20, 0.7))


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


def solve(outline: Outline, goal: Point | Polygon, tolerance: float) -> Solution:
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
        solution = _solve(outline, goal, panels, attempt)
        bound = solution.accuracy.error_estimate
        if bound <= tolerance:
            return solution
        if best is not None and bound > _PROGRESS * best.error_estimate:
            break
        best, last = solution.accuracy, attempt
        if _EPSILON * best.condition > tolerance:  # more nodes do not reduce rounding errors
            break
    _refuse(best, tolerance, outline, panels, unknowns)


def _is_promising(attempt: Attempt, last: Attempt, excess: float) -> bool:
    """Whether an attempt may reduce the error by a factor; the last one of a closeness is always made."""
    final = max(other.nodes for other in _ATTEMPTS if other.closeness == attempt.closeness)
    gain = _GAIN ** (attempt.nodes - last.nodes)
    return attempt.closeness != last.closeness or attempt.nodes == final or gain >= excess


def _angles(outline: Outline) -> FloatArray:
    """Angles of the corners [rad], rounded to 1e-12 so that equal corners share one operator in the cache."""
    return np.round(outline.corner_angles, 12)


def _unknowns(outline: Outline, panels: Panels, attempt: Attempt) -> int:
    """Size of the linear system without the holes' images."""
    legs = sum(2 * len(leg_panels(float(angle), attempt.closeness)[0]) - 2 for angle in _angles(outline))
    return attempt.nodes * (len(panels.edge) + legs)


def _solve(outline: Outline, goal: Point | Polygon, panels: Panels, attempt: Attempt) -> Solution:
    """Make one attempt."""
    angles = _angles(outline)
    centre = np.array([outline.centre.real, outline.centre.imag])
    # Coordinates of points are rounded: a point outside by less than this counts as on the wall.
    rounding = 8.0 * _EPSILON * (abs(outline.centre) + outline.diameter)
    density = solve_density(outline, panels, angles, *attempt)
    arrays = pack_layers(outline, panels, angles, density, attempt.closeness)
    flat = flatten(arrays, centre, rounding)
    unknowns = len(density.weighted) + outline.holes
    accuracy = estimate_accuracy(outline, panels, flat, density.hole_images, unknowns, density.condition)
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
    fault = find_fault(outline, panels, place, edge)
    where = place + outline.centre
    raise UnmappableError(
        f"the harmonic map would take {unknowns} unknowns, at most {_MAX_UNKNOWNS} are allowed; narrowest is "
        + fault.description,
        (where.real, where.imag),
        angle=fault.angle,
        width=fault.gap,
    )
