"""The question of a map and the outline of the region to map: rings, their angles on the circle, the goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FieldError
from coop_drake.geometry.polygons import corners_of, extent_of, parts_of
from coop_drake.geometry.simplify import sharpest_angle, simplify_inward
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

_SHARPEST = 1.0
"""Corners with a smaller angle are refused: their panels would take minutes [degrees]."""
_STRAIGHT = 1e-12
"""A vertex closer to its neighbours' chord than this fraction of the diameter is dropped [-]."""
_ON = 1e-9
"""An edge closer to the goal's boundary than this fraction of the domain's diameter lies on it [-]."""
_SLIVER = 1e-9
"""Pieces thinner than this fraction of the diameter come from rounding [-]."""
_NEAR = 1e-3
"""A goal closer to a wall than this fraction of its own size, without touching, leaves too narrow a gap."""
_TINY = 1e-7
"""Edges shorter than this fraction of the diameter are left out: rounding decides their angles [-]."""
_SHARPEST_AT_GOAL = np.deg2rad(5.0)
"""A goal that meets a wall at a smaller angle does not collapse: too many nodes [rad]."""


def region_to_map(domain: Polygon, goal: Point | Polygon) -> tuple[Polygon, Point | Polygon]:
    """F, the region to map, and the target, which its map sends to one point.

    A goal region that has a boundary of its own, or meets the outer ring in one arc, is taken out of the
    domain and collapses. One that meets walls otherwise (in several arcs, in a single point, at a cusp, along
    a part of a hole) cannot collapse without a wall: then the target is its pole of inaccessibility, the
    point of it farthest from its boundary, and F is the whole domain. So it is where the goal is all of the
    domain or splits it. To reach the target is to reach the goal either way.

    Args:
        domain: The cell [m].
        goal: Point to reach, or region to reach.

    Returns:
        F and the target: a point, or the goal itself. Edges shorter than 1e-7 times the domain's size, whose
        ends are hardly more than rounding, are left out, inward.

    Raises:
        FieldError: If the domain is no valid polygon, or the goal is not in it.
    """
    _check_polygon(domain, "domain")
    if isinstance(goal, Point):
        if goal.is_empty or not np.isfinite(goal.coords[0]).all() or not domain.contains(goal):
            raise FieldError(f"the goal {goal.wkt} must lie strictly inside the domain{_extent(domain)}")
    else:
        _check_polygon(goal, "goal region")
        if not domain.buffer(1e-9 * domain.length).covers(goal):
            raise FieldError("the goal region must lie in the domain; intersect it with the domain first")
    tiny = _TINY * extent_of(domain)
    sides = [np.roll(ring, -1, axis=0) - ring for ring in corners_of(domain)]
    if min(np.linalg.norm(ring, axis=1).min() for ring in sides) < tiny:
        domain = simplify_inward(domain, tiny)
    if isinstance(goal, Point):
        return domain, Point(goal.x, goal.y) if goal.has_z else goal
    least = _SLIVER * extent_of(domain)
    pieces = [part for part in parts_of(domain.difference(goal)) if part.area > least * part.length]
    if len(pieces) == 1 and _can_collapse(domain, pieces[0], goal):
        return pieces[0], goal
    from coop_drake.geometry.passage import pole  # loads scipy's Voronoi diagrams, which few goals need

    return domain, Point(pole(goal)[0])


def _check_polygon(shape: object, name: str) -> None:
    """Refuse what is not one valid polygon with an area."""
    if not isinstance(shape, Polygon):
        hint = "; take one of its parts" if hasattr(shape, "geoms") else ""
        kinds = "a shapely Polygon" if name == "domain" else "a shapely Point or Polygon"
        raise FieldError(f"the {name} must be {kinds}, got {type(shape).__name__}{hint}")
    if shape.is_empty or not shape.is_valid or shape.area == 0.0:
        why = ", got an empty one" if shape.is_empty else f": {shapely.is_valid_reason(shape)}"
        raise FieldError(f"the {name} must be one valid polygon with an area{why}")


def _extent(domain: Polygon) -> str:
    """Where the domain is, in words."""
    x0, y0, x1, y1 = domain.bounds
    return f", which spans x {x0:.6g} to {x1:.6g} and y {y0:.6g} to {y1:.6g} m and may have holes"


def _can_collapse(domain: Polygon, piece: Polygon, goal: Polygon) -> bool:
    """Whether the goal is a hole of its own or one arc of the outer ring, clear of cusps and narrow gaps."""
    rings = [piece.exterior, *piece.interiors]
    on_goal = [_goal_edges(corners, goal, extent_of(domain)) for corners in corners_of(piece)]
    bounding = [k for k, flags in enumerate(on_goal) if flags.any()]
    if len(bounding) != 1:
        return False
    k = bounding[0]
    alone = bool(on_goal[k].all()) if k > 0 else np.sum(on_goal[k] & ~np.roll(on_goal[k], 1)) == 1
    walls = rings[:k] + rings[k + 1 :]
    clear = all(goal.distance(ring) > _NEAR * extent_of(goal) for ring in walls)
    least = min(_SHARPEST_AT_GOAL, 0.999 * sharpest_angle(domain))
    return bool(alone and clear and sharpest_angle(piece) >= least)


def _goal_edges(corners: FloatArray, goal: BaseGeometry, scale: float) -> NDArray[np.bool_]:
    """Which edges of a ring bound the goal region, in a domain of a diameter [m]; a point bounds nothing."""
    if isinstance(goal, Point):
        return np.zeros(len(corners), dtype=bool)
    middles = shapely.points(0.5 * (corners + np.roll(corners, -1, axis=0)))
    return np.asarray(shapely.distance(goal.boundary, middles) < _ON * scale, dtype=np.bool_)


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
        back = self.vertices[self.preceding] - self.vertices
        return np.mod(np.angle(back / (self.ends - self.vertices)), 2.0 * np.pi)

    @property
    def diameter(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.hypot(np.ptp(self.vertices.real), np.ptp(self.vertices.imag)))


def outline_of(region: Polygon, target: Point | Polygon) -> Outline:
    """Orient, clean and number the rings of F and assign the angles of the outer circle.

    The angle is linear in arc length; an arc that bounds the goal has one angle. Region and target are those
    of `region_to_map`: the target is a point, a hole of F, or one arc of its outer ring.

    Raises:
        FieldError: If a ring has no area, if rings touch, or a corner is sharper than a degree.
    """
    oriented = shapely.orient_polygons(shapely.force_2d(region))
    centre = complex(*oriented.envelope.centroid.coords[0])
    scale = extent_of(region)
    _refuse_touching_rings(oriented, scale)
    vertices, touching = [], []
    for index, corners in enumerate(corners_of(oriented)):
        z = corners @ np.array([1.0, 1.0j]) - centre
        z, on_goal = _clean(z, _goal_edges(corners, target, scale), scale)
        if len(z) < 3:
            raise FieldError(f"ring {index} of the domain has no area")
        vertices.append(z)
        touching.append(on_goal)
    lengths = [len(z) for z in vertices]
    # The outer ring's angles; on the goal's arc the angle stands still.
    sides = np.where(touching[0], 0.0, np.abs(np.roll(vertices[0], -1) - vertices[0]))
    ends = np.zeros(sum(lengths))
    ends[: lengths[0]] = np.cumsum(sides) * (2.0 * np.pi / sides.sum())
    starts = np.zeros(sum(lengths))
    starts[1 : lengths[0]] = ends[: lengths[0] - 1]
    arc = float(starts[: lengths[0]][touching[0]][0]) if touching[0].any() else None
    collapsed = [k for k in range(1, len(touching)) if touching[k].any()]
    outline = Outline(
        vertices=np.concatenate(vertices),
        following=_cyclic(lengths, 1),
        preceding=_cyclic(lengths, -1),
        ring=np.repeat(np.arange(len(lengths)), lengths),
        angle_start=starts,
        angle_end=ends,
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
            if ring.distance(other) <= _STRAIGHT * scale:
                x, y = shapely.shortest_line(ring, other).coords[0]
                raise FieldError(
                    f"a ring of the domain touches another at ({x:.6g}, {y:.6g}) m; "
                    "leave a gap or let them overlap"
                )


def _refuse_spikes(outline: Outline) -> None:
    """Refuse a corner whose angle is close to zero or to a full turn: it would take too many nodes."""
    angles = np.rad2deg(outline.corner_angles)
    worst = int(np.argmin(np.minimum(angles, 360.0 - angles)))
    angle = float(angles[worst])
    if min(angle, 360.0 - angle) < _SHARPEST:
        place = outline.vertices[worst] + outline.centre
        raise FieldError(
            f"the corner at ({place.real:.6g}, {place.imag:.6g}) m has an interior angle of {angle:.3g} "
            f"degrees; between {_SHARPEST:g} and {360.0 - _SHARPEST:g} are allowed; cut it off"
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
        drop: NDArray[np.bool_] = np.asarray(np.abs(after - z) <= _STRAIGHT * scale)
        drop |= (height <= _STRAIGHT * scale) & forward & (on_goal == np.roll(on_goal, 1))
        if not drop.any():
            break
        keep = np.arange(len(z)) != int(np.argmax(drop))
        z, on_goal = z[keep], on_goal[keep]
    return z, on_goal


def _cyclic(lengths: list[int], step: int) -> IntArray:
    """Index of the neighbour on the same ring, for rings of the given lengths one after the other."""
    starts = np.cumsum([0, *lengths[:-1]])
    rings = [s + np.roll(np.arange(n), -step) for s, n in zip(starts, lengths, strict=True)]
    return np.concatenate(rings).astype(np.int64)
