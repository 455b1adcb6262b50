"""The outline of what is mapped: rings of vertices, their angles on the circle, where the goal is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FieldError
from coop_drake.fields.quadrature import FloatArray

__all__ = ["Outline", "outline_of", "region_to_map"]

ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

_STRAIGHT = 1e-12  # a vertex is dropped if it lies this close to its neighbours' chord, times the diameter


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


def region_to_map(domain: Polygon, goal: Point | Polygon, inside: Point | None) -> Polygon:
    """F: the domain for a point goal, otherwise the piece of the domain less the goal that is to be mapped.

    Args:
        domain: The cell [m].
        goal: Point to reach, or region to reach.
        inside: A point of the piece to keep where the goal splits the domain.

    Raises:
        FieldError: If the domain is no valid polygon, the goal is not in it, or the piece is undetermined.
    """
    if not isinstance(domain, Polygon) or domain.is_empty or not domain.is_valid:
        raise FieldError(f"the domain must be one valid polygon, got {shapely.is_valid_reason(domain)}")
    if isinstance(goal, Point):
        if goal.is_empty or not domain.contains(goal):
            raise FieldError(f"the goal {goal.wkt} must lie strictly inside the domain")
        return domain
    if goal.is_empty or not goal.is_valid or goal.area == 0.0:
        raise FieldError("the goal region must be one valid polygon with an area")
    if not domain.buffer(1e-9 * domain.length).covers(goal):
        raise FieldError("the goal region must lie in the domain; intersect it with the domain first")
    pieces = [
        p for p in shapely.get_parts(domain.difference(goal)) if isinstance(p, Polygon) and not p.is_empty
    ]
    if inside is not None:
        pieces = [p for p in pieces if p.covers(inside)]
    if len(pieces) != 1:
        where = "is outside the domain or inside the goal" if inside is not None else "is needed"
        raise FieldError(
            f"the domain less the goal has {len(pieces)} pieces to choose from: the argument `inside`, "
            f"a point of the piece to map, {where}"
        )
    return pieces[0]


def outline_of(region: Polygon, goal: Point | Polygon) -> Outline:
    """Orient, clean and number the rings of F and share out the angles of the outer circle.

    The angle is linear in arc length; an arc that bounds the goal gets none.

    Args:
        region: F, from `region_to_map`.
        goal: The goal it was made with.

    Raises:
        FieldError: If the goal bounds the outer ring in several separate arcs, or all of it; if rings touch.
    """
    oriented = shapely.orient_polygons(region)
    centre = complex(*oriented.envelope.centroid.coords[0])
    scale = float(np.hypot(*np.subtract(region.bounds[2:], region.bounds[:2])))
    _refuse_touching_rings(oriented, scale)
    vertices, touching, rings = [], [], []
    for index, ring in enumerate((oriented.exterior, *oriented.interiors)):
        points = np.asarray(ring.coords)[:-1]
        z, on_goal = _clean(points @ np.array([1.0, 1.0j]) - centre, _goal_edges(points, goal, scale), scale)
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
    return Outline(
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


def _refuse_touching_rings(region: Polygon, scale: float) -> None:
    """Two rings that meet in a point leave a gap of width zero."""
    rings = [region.exterior, *region.interiors]
    for k, ring in enumerate(rings):
        for other in rings[:k]:
            if ring.distance(other) <= _STRAIGHT * scale:
                place = shapely.shortest_line(ring, other).coords[0]
                raise FieldError(
                    f"a ring of the domain less the goal touches another at ({place[0]:.6g}, {place[1]:.6g})"
                    " m; leave a gap or let them overlap"
                )


def _goal_edges(points: FloatArray, goal: BaseGeometry, scale: float) -> NDArray[np.bool_]:
    """Which edges of a ring bound the goal region, shape (n,)."""
    if isinstance(goal, Point):
        return np.zeros(len(points), dtype=bool)
    middles = shapely.points(0.5 * (points + np.roll(points, -1, axis=0)))
    return np.asarray(shapely.distance(goal.boundary, middles) < 1e-9 * scale, dtype=np.bool_)


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
    arcs = int(np.sum(on_goal & ~np.roll(on_goal, 1)))
    if on_goal.all() or arcs > 1:
        raise FieldError(
            f"the goal bounds the outer ring in {arcs or 1} arcs"
            + (" that leave nothing of it" if on_goal.all() else "; only one can collapse to a point")
        )
    lengths = np.where(on_goal, 0.0, np.abs(np.roll(z, -1) - z))
    ends = np.cumsum(lengths) * (2.0 * np.pi / lengths.sum())
    return np.concatenate(([0.0], ends[:-1])), ends
