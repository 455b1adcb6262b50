"""The outline of a region to map: rings of vertices, their angles on the circle, and the goal's place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.fields.goals import goal_edges
from coop_drake.geometry.parts import extent_of
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray

_SHARPEST = 1.0
"""Corners with a smaller angle are refused: their panels would take minutes [degrees]."""
_STRAIGHT = 1e-12
"""A vertex closer to its neighbours' chord than this fraction of the diameter is dropped [-]."""


@dataclass(frozen=True)
class Outline:
    """Rings with the domain on the left of every edge: the outer ring first, then the holes.

    Edge e runs from vertex e to vertex ``following[e]``. Coordinates are x + i y relative to ``centre`` [m].

    Attributes:
        vertices: Vertices of all rings, shape (n,).
        following: Index of the next vertex on the same ring, shape (n,).
        preceding: Index of the previous vertex, shape (n,).
        ring: Ring of each vertex, 0 for the outer one, shape (n,).
        angle_start: Boundary angle at the start of each outer edge, 0 on holes [rad], shape (n,).
        angle_end: Boundary angle at its end, shape (n,).
        centre: Origin of the coordinates in W.
        goal_ring: The hole that a goal region is, None for a point goal or a goal on the outer ring.
        goal_angle: Angle that the arc of a goal on the outer ring collapses to, otherwise None [rad].
    """

    vertices: ComplexArray
    following: IntArray
    preceding: IntArray
    ring: IntArray
    angle_start: FloatArray
    angle_end: FloatArray
    centre: complex
    goal_ring: int | None
    goal_angle: float | None

    @property
    def holes(self) -> int:
        """Number of holes."""
        return int(self.ring[-1])

    @property
    def ends(self) -> ComplexArray:
        """End of each edge, shape (n,)."""
        return self.vertices[self.following]

    @property
    def corner_angles(self) -> FloatArray:
        """Interior angle at each vertex [rad], in (0, 2 pi), shape (n,)."""
        out = self.vertices[self.following] - self.vertices
        back = self.vertices[self.preceding] - self.vertices
        return np.mod(np.angle(back / out), 2.0 * np.pi)

    @property
    def diameter(self) -> float:
        """Diagonal of the bounding box [m]."""
        v = self.vertices
        return float(np.hypot(np.ptp(v.real), np.ptp(v.imag)))


def outline_of(region: Polygon, target: Point | Polygon) -> Outline:
    """Orient, clean and number the rings of F and assign the angles of the outer circle.

    The angle is linear in arc length; an arc that bounds the goal has one angle.

    Args:
        region: F, from `region_to_map`.
        target: The target from `region_to_map`: a point, a hole of F, or one arc of its outer ring.

    Raises:
        UnmappableError: If rings touch, or a corner is sharper than a degree.
    """
    oriented = shapely.orient_polygons(shapely.force_2d(region))
    centre = complex(*oriented.envelope.centroid.coords[0])
    scale = extent_of(region)
    _refuse_touching_rings(oriented, scale)
    vertices, touching, rings = [], [], []
    for index, ring in enumerate((oriented.exterior, *oriented.interiors)):
        points = np.asarray(ring.coords)[:-1]
        z, on_goal = _clean(points @ np.array([1.0, 1.0j]) - centre, goal_edges(points, target, scale), scale)
        if len(z) < 3:
            raise FieldError(f"ring {index} of the domain has no area")
        vertices.append(z)
        touching.append(on_goal)
        rings.append(np.full(len(z), index))
    following = _cyclic([len(z) for z in vertices], 1)
    z, ring_of = np.concatenate(vertices), np.concatenate(rings)
    start, end = np.zeros(len(z)), np.zeros(len(z))
    n = len(vertices[0])
    start[:n], end[:n] = _outer_angles(vertices[0], touching[0])
    arc = float(start[:n][touching[0]][0]) if touching[0].any() else None
    collapsed = [k for k in range(1, len(touching)) if touching[k].any()]
    outline = Outline(
        vertices=z,
        following=following,
        preceding=_cyclic([len(v) for v in vertices], -1),
        ring=ring_of,
        angle_start=start,
        angle_end=end,
        centre=centre,
        goal_ring=collapsed[0] if collapsed and arc is None else None,
        goal_angle=arc,
    )
    _refuse_spikes(outline)
    return outline


def _refuse_touching_rings(region: Polygon, scale: float) -> None:
    """Refuse two rings that meet in a point: the gap between them has no width."""
    rings = [region.exterior, *region.interiors]
    for k, ring in enumerate(rings):
        for other in rings[:k]:
            width = float(ring.distance(other))
            if width <= _STRAIGHT * scale:
                x, y = shapely.shortest_line(ring, other).coords[0]
                raise UnmappableError(
                    f"a ring of the domain touches another at ({x:.6g}, {y:.6g}) m; "
                    "leave a gap or let them overlap",
                    (x, y),
                    width=width,
                )


def _refuse_spikes(outline: Outline) -> None:
    """Refuse a corner whose angle is close to zero or to a full turn: it would take too many nodes."""
    angles = np.rad2deg(outline.corner_angles)
    worst = int(np.argmin(np.minimum(angles, 360.0 - angles)))
    angle = float(angles[worst])
    if min(angle, 360.0 - angle) < _SHARPEST:
        place = outline.vertices[worst] + outline.centre
        raise UnmappableError(
            f"the corner at ({place.real:.6g}, {place.imag:.6g}) m has an interior angle of {angle:.3g} "
            f"degrees; between {_SHARPEST:g} and {360.0 - _SHARPEST:g} are allowed; cut it off",
            (place.real, place.imag),
            angle=angle,
        )


def _clean(
    z: ComplexArray, on_goal: NDArray[np.bool_], scale: float
) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """Drop repeated and collinear vertices, keeping the ends of goal arcs."""
    while len(z) > 3:
        before, after = np.roll(z, 1), np.roll(z, -1)
        chord = after - before
        height = np.abs(np.imag(np.conj(chord) * (z - before))) / np.maximum(np.abs(chord), 1e-300)
        forward = np.real(np.conj(z - before) * (after - z)) > 0.0
        same = on_goal == np.roll(on_goal, 1)
        drop: NDArray[np.bool_] = np.asarray(np.abs(after - z) <= _STRAIGHT * scale)
        drop |= (height <= _STRAIGHT * scale) & forward & same
        if not drop.any():
            break
        keep = np.arange(len(z)) != int(np.argmax(drop))
        z, on_goal = z[keep], on_goal[keep]
    return z, on_goal


def _cyclic(lengths: list[int], step: int) -> IntArray:
    """Index of the neighbour on the same ring, for rings of the given lengths one after the other."""
    starts = np.cumsum([0, *lengths[:-1]])
    return np.concatenate(
        [s + np.roll(np.arange(n), -step) for s, n in zip(starts, lengths, strict=True)]
    ).astype(np.int64)


def _outer_angles(z: ComplexArray, on_goal: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Angles at the start and the end of each outer edge [rad]."""
    lengths = np.where(on_goal, 0.0, np.abs(np.roll(z, -1) - z))
    ends = np.cumsum(lengths) * (2.0 * np.pi / lengths.sum())
    return np.concatenate(([0.0], ends[:-1])), ends
