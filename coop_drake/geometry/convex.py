"""Convex polygons as sets of supporting lines ``n(angle) . x <= offset``: the arithmetic of all sweeps."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.geometry.pose import FloatArray

SLACK = 1e-9
"""Directed rounding [m]: outer offsets grow and inner offsets shrink by it."""

_TURN = 2.0 * pi
_SAME_ANGLE = 1e-5
_SAME_POINT = 1e-11
_LARGEST_TURN = 0.75 * pi
_QUARTER_TURN = np.array([-1.0, 1.0])


def following(ring: FloatArray) -> FloatArray:
    """Ring that starts one entry later; shape (n, ...) to the same."""
    return np.concatenate((ring[1:], ring[:1]))


def preceding(ring: FloatArray) -> FloatArray:
    """Ring that starts one entry earlier; shape (n, ...) to the same."""
    return np.concatenate((ring[-1:], ring[:-1]))


def normals(angles: FloatArray) -> FloatArray:
    """Unit vectors at the angles; shape (k,) [rad] to (k, 2)."""
    result = np.empty((*angles.shape, 2))
    np.cos(angles, out=result[..., 0])
    np.sin(angles, out=result[..., 1])
    return result


def edge_angles(vertices: FloatArray) -> FloatArray:
    """Angles of the outward normals of a counter-clockwise ring; shape (n, 2) to (n,), empty for a point.

    Two vertices make a segment with a normal on either side.
    """
    if len(vertices) < 2:
        return np.empty(0)
    edges = following(vertices) - vertices
    return np.arctan2(-edges[:, 0], edges[:, 1])


def support(vertices: FloatArray, angles: FloatArray) -> FloatArray:
    """Support function of the hull of the vertices: largest n . v; shapes (n, 2), (k,) to (k,) [m]."""
    best: FloatArray = (normals(angles) @ vertices.T).max(axis=1)
    return best


def closed_directions(angles: FloatArray, largest_turn: float = _LARGEST_TURN) -> FloatArray:
    """Sort directions, drop repeated ones and fill gaps so that no two neighbours are further apart.

    Args:
        angles: Any directions, shape (k,) [rad].
        largest_turn: Largest angle between neighbours of the result [rad], below pi.

    Returns:
        Directions in ascending order within one turn, shape (m,).
    """
    ordered = np.sort(np.mod(angles, _TURN))
    if len(ordered) == 0:
        ordered = np.zeros(1)
    ordered = ordered[ordered - np.concatenate((ordered[-1:] - _TURN, ordered[:-1])) > _SAME_ANGLE]
    gaps = np.concatenate((ordered[1:], ordered[:1] + _TURN)) - ordered
    if gaps.max() <= largest_turn:
        return np.asarray(ordered)
    counts = np.ceil(gaps / largest_turn).astype(np.int64)
    steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    filled: FloatArray = np.repeat(ordered, counts) + steps * np.repeat(gaps / counts, counts)
    return filled


def circumscribed(angles: FloatArray, offsets: FloatArray) -> FloatArray:
    """Polygon whose edges lie on supporting lines of one convex set; it encloses that set.

    Args:
        angles: Sorted directions, neighbours less than pi apart, shape (k,) [rad].
        offsets: Value of the set's support function at each, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, without repetitions, shape (m, 2).
    """
    h = offsets + SLACK
    n = normals(angles)
    n_after, h_after = following(n), following(h)
    turn = n[:, 0] * n_after[:, 1] - n[:, 1] * n_after[:, 0]
    vertices = np.empty_like(n)
    vertices[:, 0] = (h * n_after[:, 1] - h_after * n[:, 1]) / turn
    vertices[:, 1] = (h_after * n[:, 0] - h * n_after[:, 0]) / turn
    distinct = vertices[np.abs(vertices - preceding(vertices)).max(axis=1) > _SAME_POINT]
    return distinct if len(distinct) >= 3 else vertices


def half_planes_polygon(angles: FloatArray, offsets: FloatArray) -> FloatArray | None:
    """Intersection of half-planes that bound a polygon, a hair inside.

    Every line is cut by all others at once, which needs no loop: line i keeps the stretch between the
    largest of its lower and the smallest of its upper crossings.

    Args:
        angles: Directions of the outward normals, shape (k,) [rad].
        offsets: Signed distances of the lines from the origin, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, shape (m, 2), or None where the intersection has no interior.
    """
    angles = np.mod(angles, _TURN)
    order = np.lexsort((offsets, angles))
    angles, h = angles[order], offsets[order] - SLACK
    first = np.ones(len(angles), dtype=bool)
    first[1:] = angles[1:] - angles[:-1] > 1e-12
    angles, h = angles[first], h[first]
    n = normals(angles)
    sine = n[:, :1] * n[:, 1] - n[:, 1:] * n[:, 0]
    room = h - h[:, None] * (n @ n.T)
    parallel = np.abs(sine) < 1e-12
    blocked = (parallel & (room < -1e-12)).any(axis=1)
    crossing = room / np.where(parallel, 1.0, sine)
    upper = np.where(~parallel & (sine > 0.0), crossing, np.inf).min(axis=1)
    lower = np.where(~parallel & (sine < 0.0), crossing, -np.inf).max(axis=1)
    kept = ~blocked & (upper - lower > 1e-9)
    if kept.sum() < 3:
        return None
    n, h, upper = n[kept], h[kept, None], upper[kept, None]
    vertices: FloatArray = h * n + upper * (n[:, ::-1] * _QUARTER_TURN)
    return vertices


def separated(first: FloatArray, second: FloatArray, gap: float = 0.0) -> bool:
    """Whether some edge's line keeps two convex polygons further apart than ``gap`` [m].

    A negative gap lets them overlap that deep and still be told apart.
    """
    return _edge_separates(first, second, gap) or _edge_separates(second, first, gap)


def _edge_separates(first: FloatArray, second: FloatArray, gap: float) -> bool:
    edges = following(first) - first
    outward = edges[:, ::-1] * -_QUARTER_TURN
    reach = np.einsum("ij,ij->i", outward, first) + gap * np.hypot(edges[:, 0], edges[:, 1])
    nearest = (outward @ second.T).min(axis=1)
    return bool((nearest > reach).any())
