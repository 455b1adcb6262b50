"""Divides a boundary into panels and places the nodes on them; what a corner does to the field around it.

Each corner has two legs of equal length, between them lie panels. Near a corner the density obeys the same
equation at every scale, because the kernel of two straight legs depends on the ratio of distances alone.
Recursive compression (Helsing and Ojala, 2008) turns that into a fixed point R = Z + U R (I - X R)^-1 V,
which doubling reaches in a few steps: each composes the map with itself. By mirror symmetry of the legs
everything splits into an even and an odd part.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import ceil, cos, log, log1p, pi, sin

import numpy as np
from numpy.polynomial import legendre

from coop_drake.geometry.polygons import squared_distance
from coop_drake.harmonic_maps.outline import Outline
from coop_drake.jit import compiled
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

_MAX_ANGLE = np.pi / 3
"""Span of the boundary angle that one panel resolves with ten nodes to 1e-8 [rad]."""
_SLIVER = 1e-3
"""A rest of an edge shorter than this fraction of a leg is not worth a panel [-]."""
_MAX_PANELS = 100_000
"""Stop of a subdivision that cannot end; far fewer exceed the unknowns that are allowed."""
_DEEPEST = 254
"""Halvings of one edge at most: the size of the stack; 50 of them reach rounding."""
_BROAD = 4.0 * pi / 9.0
"""Gap between the legs from which one panel resolves the other leg at every scale [rad]."""
_DOUBLINGS = 7
"""2^7 dyadic levels: what the next would add is below rounding for every angle."""


@cache
def gauss_nodes(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes in [-1, 1] and weights (count,) that integrate polynomials of degree 2 count - 1 exactly."""
    nodes, weights = legendre.leggauss(count)
    return nodes, weights


@cache
def legendre_transform(count: int) -> FloatArray:
    """Matrix (count, count) from values at the Gauss nodes to Legendre coefficients, lowest degree first."""
    nodes, weights = gauss_nodes(count)
    return (np.arange(count)[:, None] + 0.5) * legendre.legvander(nodes, count - 1).T * weights


@dataclass(frozen=True)
class Panels:
    """The panels of a boundary.

    Attributes:
        legs: Length of the two legs of each corner [m], shape (corners,).
        edge: Edge of each regular panel, shape (panels,).
        start: Distance of its start from the start of the edge [m], shape (panels,).
        end: Distance of its end, shape (panels,).
        gap: Distance of each panel to the nearest other edge [m], shape (panels,).
    """

    legs: FloatArray
    edge: IntArray
    start: FloatArray
    end: FloatArray
    gap: FloatArray


def lay_panels(outline: Outline, closeness: float) -> Panels:
    """Divide the boundary so that every panel resolves the density on it.

    Legs are not longer than ``closeness`` times their distance to the other edges. Regular panels may lie
    along a wall at any distance, because near panels are integrated exactly: they are not longer than
    ``closeness`` times their distance to the other edges or to the nearest vertex, whichever is more.
    """
    starts, ends = outline.vertices, outline.ends
    edges = np.column_stack((starts.real, starts.imag, ends.real, ends.imag))
    total = np.abs(ends - starts)[outline.ring == 0].sum()
    spans = outline.angle_end - outline.angle_start
    # Length of boundary that spans the largest angle allowed; holes and collapsed arcs span none.
    longest = np.where(spans > 0.0, _MAX_ANGLE * np.abs(ends - starts) / np.maximum(spans, 1e-300), total)
    legs = _corner_legs(edges, outline.preceding, longest, closeness)
    _close_slivers(np.abs(ends - starts), outline.following, legs)
    rows = np.empty((_MAX_PANELS, 4))
    pieces = rows[: _edge_panels(edges, outline.following, legs, longest, closeness, rows)]
    return Panels(legs, pieces[:, 0].astype(np.int64), pieces[:, 1], pieces[:, 2], pieces[:, 3])


@compiled(borrows=True)
def segment_distance(p: FloatArray, q: FloatArray) -> float:
    """Distance of two segments (x0, y0, x1, y1) that do not cross [m]."""
    squared = min(
        min(
            squared_distance(p[0], p[1], q[0], q[1], q[2], q[3]),
            squared_distance(p[2], p[3], q[0], q[1], q[2], q[3]),
        ),
        min(
            squared_distance(q[0], q[1], p[0], p[1], p[2], p[3]),
            squared_distance(q[2], q[3], p[0], p[1], p[2], p[3]),
        ),
    )
    return float(np.sqrt(squared))


@compiled
def _corner_legs(
    edges: FloatArray, preceding: np.ndarray, longest: FloatArray, closeness: float
) -> FloatArray:
    """Leg length of each corner: half the shorter edge, shortened until the other edges are far enough."""
    n = len(edges)
    legs = np.empty(n)
    leg = np.empty(4)
    for v in range(n):
        b = preceding[v]
        length = 1e300
        for e in (b, v):
            length = min(length, 0.5 * np.hypot(edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]))
            length = min(length, longest[e])
        leg[0], leg[1] = edges[v, 0], edges[v, 1]
        for _ in range(200):
            gap = 1e300
            for e in (b, v):
                far_x = edges[e, 0] + edges[e, 2] - leg[0]
                far_y = edges[e, 1] + edges[e, 3] - leg[1]
                part = length / np.hypot(far_x - leg[0], far_y - leg[1])
                leg[2], leg[3] = leg[0] + part * (far_x - leg[0]), leg[1] + part * (far_y - leg[1])
                for other in range(n):
                    if other not in (b, v):
                        gap = min(gap, segment_distance(leg, edges[other]))
            if length <= closeness * gap:
                break
            length = max(0.5 * length, closeness * gap)
        legs[v] = length
    return legs


def _close_slivers(lengths: FloatArray, following: np.ndarray, legs: FloatArray) -> None:
    """Make two legs that almost fill an edge meet: a panel as short as rounding could not be evaluated.

    Follows each ring; if the last edge still has a sliver, the legs of the first corner become shorter.
    """
    for e in range(len(lengths)):
        after = following[e]
        rest = lengths[e] - legs[e] - legs[after]
        if abs(rest) <= _SLIVER * min(legs[e], legs[after]):
            if after > e:
                legs[after] = lengths[e] - legs[e]
            elif abs(rest) > 1e-12 * lengths[e]:
                legs[after] *= 0.8


@compiled
def _edge_panels(
    edges: FloatArray, following: np.ndarray, legs: FloatArray, longest: FloatArray, closeness: float,
    rows: FloatArray,
) -> int:  # fmt: skip
    """Write rows (edge, start, end, gap) of the regular panels, in order along every edge; return how many.

    A panel that is too long is halved; the stack holds the pieces of one edge that are still to be judged.
    """
    count = 0
    piece = np.empty(4)
    stack = np.empty((_DEEPEST + 2, 2))
    for e in range(len(edges)):
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        length = np.sqrt(dx * dx + dy * dy)
        dx, dy = dx / length, dy / length
        stack[0, 0], stack[0, 1] = legs[e], length - legs[following[e]]
        depth = 1 if stack[0, 1] - stack[0, 0] > 1e-12 * length else 0
        while depth > 0 and count < len(rows):
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            piece[0], piece[1] = edges[e, 0] + a * dx, edges[e, 1] + a * dy
            piece[2], piece[3] = edges[e, 0] + b * dx, edges[e, 1] + b * dy
            gap, vertex = 1e300, 1e300
            for other in range(len(edges)):
                if other != e:
                    gap = min(gap, segment_distance(piece, edges[other]))
                x, y = edges[other, 0], edges[other, 1]
                squared = squared_distance(x, y, piece[0], piece[1], piece[2], piece[3])
                vertex = min(vertex, np.sqrt(squared))
            short = b - a <= min(closeness * max(gap, vertex), longest[e])
            if short or depth > _DEEPEST or b - a < 1e-9 * length:
                rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = e, a, b, gap
                count += 1
            else:
                middle = 0.5 * (a + b)
                stack[depth, 0], stack[depth, 1] = middle, b
                stack[depth + 1, 0], stack[depth + 1, 1] = a, middle
                depth += 2
    return count


@dataclass(frozen=True)
class Nodes:
    """All nodes of one discretisation: each corner's incoming leg then its outgoing leg, then regular panels.

    On both legs the nodes count from the corner outwards.

    Attributes:
        position: Nodes as x + i y [m], shape (n,).
        element: dt times weight along the boundary's direction, shape (n,).
        edge: Edge of each node, shape (n,).
        corner: Corner whose block holds the node, -1 on regular panels, shape (n,).
        boundary_value: g: exp(i angle) on the outer ring, 0 on holes, shape (n,).
        corner_start: First node of each corner's block, one more entry ends the last, shape (corners + 1,).
    """

    position: ComplexArray
    element: ComplexArray
    edge: IntArray
    corner: IntArray
    boundary_value: ComplexArray
    corner_start: IntArray


def place_nodes(outline: Outline, panels: Panels, angles: FloatArray, nodes: int, closeness: float) -> Nodes:
    """Place ``nodes`` Gauss nodes on every panel.

    The interior angles of the corners have shape (corners,) [rad]. ``closeness``: longest panel per unit of
    distance, see `leg_panels`.
    """
    v, following, preceding = outline.vertices, outline.following, outline.preceding
    length = np.abs(v[following] - v)
    tangent = (v[following] - v) / length
    along, weight, edge, corner, starts = [], [], [], [], [0]
    for k, angle in enumerate(angles):
        x, w = panel_nodes(leg_panels(float(angle), closeness)[0], nodes)
        before, leg = preceding[k], panels.legs[k]
        along += [length[before] - leg * x, leg * x]
        weight += [leg * w, leg * w]
        edge += [np.full(len(x), before), np.full(len(x), k)]
        corner.append(np.full(2 * len(x), k))
        starts.append(starts[-1] + 2 * len(x))
    x, w = gauss_nodes(nodes)
    half = 0.5 * (panels.end - panels.start)[:, None]
    along.append((0.5 * (panels.end + panels.start)[:, None] + half * x).ravel())
    weight.append((half * w).ravel())
    edge.append(np.repeat(panels.edge, nodes))
    corner.append(np.full(half.size * nodes, -1))
    s, e = np.concatenate(along), np.concatenate(edge).astype(np.int64)
    angle_at = outline.angle_start[e] + (outline.angle_end - outline.angle_start)[e] * (s / length[e])
    return Nodes(
        position=v[e] + s * tangent[e],
        element=np.concatenate(weight) * tangent[e],
        edge=e,
        corner=np.concatenate(corner).astype(np.int64),
        boundary_value=np.where(outline.ring[e] == 0, np.exp(1j * angle_at), 0.0),
        corner_start=np.array(starts, dtype=np.int64),
    )


@dataclass(frozen=True)
class CornerOperator:
    """What a corner does to the field that comes in from the rest of the boundary; index 0 even, 1 odd.

    The incoming field lives on the grid of one leg (n nodes, see `leg_panels`); the ring is its outer half.

    Attributes:
        compressed: R: incoming field -> weight-corrected density on the leg, shape (2, n, n).
        ring: Incoming field -> density on the ring's nodes, shape (2, m, n).
        inward: Incoming field -> incoming field of the same corner at half the scale, shape (2, n, n).
    """

    compressed: FloatArray
    ring: FloatArray
    inward: FloatArray


def leg_panels(angle: float, closeness: float) -> tuple[FloatArray, FloatArray]:
    """Breakpoints of one leg scaled to [0, 1]: of the grid, and of its ring [1/2, 1].

    A corner that is neither sharp nor nearly a slit has one panel a leg and one in its ring; otherwise the
    ring is split so that no panel is longer than ``closeness`` times its distance to the other leg. The
    interior angle lies in (0, 2 pi) [rad].
    """
    gap = min(angle, 2.0 * pi - angle)
    if gap >= _BROAD - 1e-9:
        return np.array([0.0, 1.0]), np.array([0.5, 1.0])
    count = ceil(log(2.0) / log1p(closeness * sin(gap)))
    ring = 0.5 * 2.0 ** (np.arange(count + 1) / count)
    ring[-1] = 1.0
    return np.concatenate(([0.0], ring)), ring


def panel_nodes(breaks: FloatArray, nodes: int) -> tuple[FloatArray, FloatArray]:
    """Gauss nodes and weights of consecutive panels, each flat of shape (panels * nodes,)."""
    x, w = gauss_nodes(nodes)
    half = 0.5 * np.diff(breaks)[:, None]
    middle = 0.5 * (breaks[1:] + breaks[:-1])[:, None]
    return (middle + half * x).ravel(), (half * w).ravel()


@lru_cache(maxsize=4096)
def corner_operator(angle: float, nodes: int, closeness: float) -> CornerOperator:
    """Operators of one corner of an interior angle [rad], with so many Gauss nodes on a panel.

    ``closeness``: longest panel per unit of distance, see `leg_panels`.
    """
    grid, ring = leg_panels(angle, closeness)
    x_grid, w_grid = panel_nodes(grid, nodes)
    x_ring, w_ring = panel_nodes(ring, nodes)
    x_in, w_in = 0.5 * x_grid, 0.5 * w_grid
    P = _prolongation(grid, nodes, np.concatenate((x_in, x_ring)))
    n = len(x_grid)
    P_in, P_ring = P[:n], P[n:]
    W_in, W_ring = (w_in[:, None] * P_in / w_grid).T, (w_ring[:, None] * P_ring / w_grid).T

    sign = np.array([1.0, -1.0])[:, None, None]
    K_in_ring = sign * _wedge_kernel(angle, x_in, x_ring, w_ring)
    K_ring_in = sign * _wedge_kernel(angle, x_ring, x_in, w_in)
    A = np.linalg.inv(np.eye(len(x_ring)) + sign * _wedge_kernel(angle, x_ring, x_ring, w_ring))
    # M^-1 by blocks: the ring is eliminated first, the inner leg carries R of the scale below.
    V = P_in - K_in_ring @ A @ P_ring
    U = W_in - W_ring @ A @ K_ring_in
    Z = W_ring @ A @ P_ring
    X = K_in_ring @ A @ K_ring_in
    R = _fixed_point(Z, U, V, X)
    inward: FloatArray = np.asarray(np.linalg.solve(np.eye(n) - X @ R, V), dtype=float)
    ring_density: FloatArray = A @ (P_ring - K_ring_in @ R @ inward)
    return CornerOperator(R, ring_density, inward)


def _prolongation(breaks: FloatArray, nodes: int, points: FloatArray) -> FloatArray:
    """Interpolation from nodes of consecutive panels to points in (0, 1), (points, panels * nodes)."""
    panel = np.clip(np.searchsorted(breaks, points) - 1, 0, len(breaks) - 2)
    matrix = np.zeros((len(points), (len(breaks) - 1) * nodes))
    for k in range(len(breaks) - 1):
        rows = np.flatnonzero(panel == k)
        local = (2.0 * points[rows] - breaks[k] - breaks[k + 1]) / (breaks[k + 1] - breaks[k])
        values = legendre.legvander(local, nodes - 1) @ legendre_transform(nodes)
        matrix[rows, k * nodes : (k + 1) * nodes] = values
    return matrix


def _wedge_kernel(angle: float, target: FloatArray, source: FloatArray, weight: FloatArray) -> FloatArray:
    """Twice the double layer of one leg on the other, at distances from the corner, times the weights."""
    s, t = target[:, None], source[None, :]
    return (s * sin(angle) / pi) / (s * s + t * t - 2.0 * cos(angle) * s * t) * weight


def _fixed_point(Z: FloatArray, U: FloatArray, V: FloatArray, X: FloatArray) -> FloatArray:
    """Fixed point of R -> Z + U R (I - X R)^-1 V by composing the map with itself; stacks of matrices."""
    n = Z.shape[-1]
    identity = np.eye(n)
    for _ in range(_DOUBLINGS - 1):
        DV = np.linalg.solve(identity - X @ Z, np.concatenate((V, X @ U), axis=-1))
        D_V, D_XU = DV[..., :n], DV[..., n:]
        Z, U, V, X = Z + U @ Z @ D_V, U @ (U + Z @ D_XU), V @ D_V, X + V @ D_XU
    return Z + U @ Z @ np.linalg.solve(identity - X @ Z, V)
