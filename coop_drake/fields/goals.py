"""Checks domain and goal, and finds the region that is left when the goal collapses to a point."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FieldError
from coop_drake.geometry.parts import extent_of
from coop_drake.geometry.simplify import sharpest_angle, simplify_inward
from coop_drake.tree.pose import FloatArray

_ON = 1e-9
"""An edge closer to the goal's boundary than this fraction of the domain's diameter lies on it [-]."""
_SLIVER = 1e-9
"""Pieces thinner than this fraction of the diameter come from rounding [-]."""
_NEAR = 1e-3
"""A goal closer to a wall than this fraction of its own size, without touching, leaves too narrow a gap
[-]."""
_TINY = 1e-7
"""Edges shorter than this fraction of the diameter are removed: rounding decides the angles at their ends
[-]."""
_SHARPEST = np.deg2rad(5.0)
"""A goal that meets a wall at a smaller angle does not collapse: the corner would take too many nodes
[rad]."""


def region_to_map(
    domain: Polygon, goal: Point | Polygon, inside: Point | None = None
) -> tuple[Polygon, Point | Polygon]:
    """F, the region to map, and the target, which its map sends to one point.

    A goal region that has a boundary of its own, or meets the outer ring in one arc, is taken out of the
    domain and collapses. One that meets walls otherwise (in several arcs, in a single point, at a cusp, along
    a part of a hole) cannot collapse without a wall: then the target is its pole of inaccessibility, the
    point of it farthest from its boundary, and F is the whole domain. So it is where nothing but the goal is
    left or the start lies in it. To reach the target is to reach the goal either way.

    Args:
        domain: The cell [m].
        goal: Point to reach, or region to reach.
        inside: A point of the piece to keep where the goal splits the domain, for example the start.

    Returns:
        F and the target: a point, or the goal itself. Edges shorter than 1e-7 times the domain's size, whose
        ends are hardly more than rounding, are left out, inward.

    Raises:
        FieldError: If the domain is no valid polygon, the goal is not in it, or the piece is undetermined.
    """
    check_question(domain, goal)
    domain = _without_tiny_edges(domain)
    if isinstance(goal, Point):
        return domain, Point(goal.x, goal.y) if goal.has_z else goal
    piece = _piece_to_keep(domain, goal, inside)
    if piece is not None and _can_collapse(domain, piece, goal):
        return piece, goal
    return domain, pole_of(goal)


def check_question(domain: Polygon, goal: Point | Polygon) -> None:
    """Refuse by a FieldError a domain that is no valid polygon, or a goal that is not in it."""
    check_polygon(domain, "domain")
    if isinstance(goal, Point):
        if goal.is_empty or not np.isfinite(goal.coords[0]).all() or not domain.contains(goal):
            raise FieldError(f"the goal {goal.wkt} must lie strictly inside the domain{_extent(domain)}")
        return
    check_polygon(goal, "goal region")
    if not domain.buffer(1e-9 * domain.length).covers(goal):
        raise FieldError("the goal region must lie in the domain; intersect it with the domain first")


def pole_of(goal: Polygon) -> Point:
    """The point of a goal region that is farthest from its boundary."""
    from coop_drake.geometry.passage import pole  # loads scipy's Voronoi diagrams, which few goals need

    return Point(pole(goal)[0])


def goal_edges(points: FloatArray, goal: BaseGeometry, scale: float) -> NDArray[np.bool_]:
    """Which edges of a ring bound the goal region; a point bounds nothing.

    The ring has its vertices once, shape (n, 2) [m], in a domain of a diameter ``scale`` [m]; one flag for
    the edge that starts at each vertex, shape (n,).
    """
    if isinstance(goal, Point):
        return np.zeros(len(points), dtype=bool)
    middles = shapely.points(0.5 * (points + np.roll(points, -1, axis=0)))
    return np.asarray(shapely.distance(goal.boundary, middles) < _ON * scale, dtype=np.bool_)


def check_polygon(shape: object, name: str) -> None:
    """Refuse by a FieldError what is not one valid polygon with an area."""
    if not isinstance(shape, Polygon):
        hint = "; take one of its parts" if hasattr(shape, "geoms") else ""
        kinds = "a shapely Polygon" if name == "domain" else "a shapely Point or Polygon"
        raise FieldError(f"the {name} must be {kinds}, got {type(shape).__name__}{hint}")
    if shape.is_empty:
        raise FieldError(f"the {name} must be one valid polygon with an area, got an empty one")
    if not shape.is_valid or shape.area == 0.0:
        raise FieldError(
            f"the {name} must be one valid polygon with an area: {shapely.is_valid_reason(shape)}"
        )


def _without_tiny_edges(domain: Polygon) -> Polygon:
    """The domain, simplified inward by no more than tiny edges are long if it has any."""
    scale = extent_of(domain)
    rings = [shapely.get_coordinates(ring) for ring in (domain.exterior, *domain.interiors)]
    shortest = min(float(np.linalg.norm(np.diff(ring, axis=0), axis=1).min()) for ring in rings)
    return simplify_inward(domain, _TINY * scale) if shortest < _TINY * scale else domain


def _extent(domain: Polygon) -> str:
    """Where the domain is, in words."""
    x0, y0, x1, y1 = domain.bounds
    return f", which spans x {x0:.6g} to {x1:.6g} and y {y0:.6g} to {y1:.6g} m and may have holes"


def _piece_to_keep(domain: Polygon, goal: Polygon, inside: Point | None) -> Polygon | None:
    """The piece of the domain less the goal that holds a point, or the only one; None within the goal.

    Raises:
        FieldError: If the point is needed but missing, or outside the domain.
    """
    least = _SLIVER * extent_of(domain)
    parts = shapely.get_parts(domain.difference(goal))
    pieces = [p for p in parts if isinstance(p, Polygon) and p.area > least * p.length]
    if inside is None and len(pieces) > 1:
        raise FieldError(
            f"the goal region splits the domain into {len(pieces)} pieces: the argument `inside`, a point of "
            "the piece to map, is needed"
        )
    if inside is not None:
        if not domain.covers(inside):
            raise FieldError(f"`inside`, {inside.wkt}, is outside the domain{_extent(domain)}")
        pieces = [p for p in pieces if p.covers(inside)]
    return pieces[0] if pieces else None


def _can_collapse(domain: Polygon, piece: Polygon, goal: Polygon) -> bool:
    """Whether the goal is a hole of its own or one arc of the outer ring, clear of cusps and narrow gaps."""
    scale = extent_of(domain)
    rings = [piece.exterior, *piece.interiors]
    on_goal = [goal_edges(shapely.get_coordinates(ring)[:-1], goal, scale) for ring in rings]
    bounding = [k for k, flags in enumerate(on_goal) if flags.any()]
    if len(bounding) != 1:
        return False
    k = bounding[0]
    arcs = int(np.sum(on_goal[k] & ~np.roll(on_goal[k], 1)))
    alone = bool(on_goal[k].all()) if k > 0 else arcs == 1
    near = _NEAR * extent_of(goal)
    walls = [ring for m, ring in enumerate(rings) if m != k]
    clear = all(goal.distance(ring) > near for ring in walls)
    return alone and clear and sharpest_angle(piece) >= min(_SHARPEST, 0.999 * sharpest_angle(domain))
