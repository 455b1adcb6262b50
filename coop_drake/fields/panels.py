"""Divides an outline into panels: two equal legs at every corner, graded panels between the legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.outline import Outline
from coop_drake.geometry.distances import squared_distance
from coop_drake.tree.pose import FloatArray

_MAX_ANGLE = np.pi / 3
"""Span of the boundary angle that one panel resolves with ten nodes to 1e-8 [rad]."""
_SLIVER = 1e-3
"""A rest of an edge shorter than this fraction of a leg is not worth a panel [-]."""
_MAX_PANELS = 100_000
"""Stop of a subdivision that cannot end; far fewer exceed the unknowns that are allowed."""
_DEEPEST = 254
"""Halvings of one edge at most: the size of the stack; 50 of them reach rounding."""


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
    edge: np.ndarray
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


@compiled(reassociate=True)
def point_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a point from a segment from a to b [m]."""
    return float(np.sqrt(squared_distance(px, py, ax, ay, bx, by)))


@compiled(reassociate=True)
def segment_distance(p: FloatArray, q: FloatArray) -> float:
    """Distance of two segments (x0, y0, x1, y1) that do not cross [m]."""
    return min(
        min(
            point_distance(p[0], p[1], q[0], q[1], q[2], q[3]),
            point_distance(p[2], p[3], q[0], q[1], q[2], q[3]),
        ),
        min(
            point_distance(q[0], q[1], p[0], p[1], p[2], p[3]),
            point_distance(q[2], q[3], p[0], p[1], p[2], p[3]),
        ),
    )


@compiled(reassociate=True)
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


@compiled(reassociate=True)
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
                vertex = min(vertex, point_distance(x, y, piece[0], piece[1], piece[2], piece[3]))
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
