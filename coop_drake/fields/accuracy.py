"""Estimates the error of a map: its residual, sampled on the boundary between the solved nodes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from coop_drake.fields.evaluation import evaluate_many
from coop_drake.fields.flat_map import FlatMap, rounding_of
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray

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


class Fault(NamedTuple):
    """A corner or a gap that limits the accuracy.

    Attributes:
        description: Its name.
        angle: Interior angle of the corner [degrees], None for a gap.
        gap: Width of the gap [m], None for a corner.
    """

    description: str
    angle: float | None
    gap: float | None


def estimate_accuracy(
    outline: Outline, panels: Panels, flat: FlatMap, hole_images: FloatArray, unknowns: int, condition: float
) -> MapAccuracy:
    """Sample the residual on every panel and far down every corner of a map, evaluated as its users do.

    The images of the holes, c_k, have shape (holes, 2); the size of the linear system and its condition are
    reported as they are given.
    """
    position, expected, edge = _samples(outline, panels, hole_images)
    vertices = np.minimum(np.abs(position - outline.vertices[edge]), np.abs(position - outline.ends[edge]))
    clear = vertices > 100.0 * rounding_of(flat)  # rounding would move closer samples across the other wall
    position, expected, edge = position[clear], expected[clear], edge[clear]
    images, _ = evaluate_many(flat, np.column_stack((position.real, position.imag)))
    residuals = np.abs(images[:, 0] + 1j * images[:, 1] - expected)
    residuals = np.where(np.isfinite(residuals), residuals, np.inf)
    worst = int(np.argmax(residuals))
    place = position[worst] + outline.centre
    fault = find_fault(outline, panels, position[worst], int(edge[worst]))
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


def find_fault(outline: Outline, panels: Panels, place: complex, edge: int) -> Fault:
    """Name the corner or the gap at a place of the boundary."""
    for vertex in (edge, int(outline.following[edge])):
        if abs(place - outline.vertices[vertex]) <= 1.5 * panels.legs[vertex]:
            return _fault_at_corner(outline, vertex)
    along = abs(place - outline.vertices[edge])
    own = np.flatnonzero(panels.edge == edge)
    nearest = own[np.argmin(np.abs(0.5 * (panels.start + panels.end)[own] - along))]
    return _gap_of(float(panels.gap[nearest]), place + outline.centre)


def _fault_at_corner(outline: Outline, vertex: int) -> Fault:
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
    return Fault(f"{corner} with interior angle {angle:.4g} degrees", angle, None)


def _gap_of(width: float, where: complex) -> Fault:
    return Fault(f"the gap of {width:.3g} m at ({where.real:.6g}, {where.imag:.6g}) m", None, width)
