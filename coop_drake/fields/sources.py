"""Panels and corners as sources of the field, seen from a point, in compiled code.

A source is named by (corner, place, level) as in `MapArrays`.
"""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.flat_map import (
    CORNER_INDEX,
    CORNERS,
    GRID,
    PANELS,
    REFINED_NODES,
    SOURCES,
    TAILS,
    FlatMap,
    integer,
    row,
    rows_of,
)
from coop_drake.fields.near_field import density_of, panel_ends
from coop_drake.fields.panels import point_distance
from coop_drake.fields.quadrature import gauss_nodes
from coop_drake.tree.pose import FloatArray

FAR = 2.2
"""|zeta| from which the solved nodes of a panel are enough to integrate over it [-]."""
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)


@compiled(reassociate=True)
def seen_from(m: FlatMap, k: int, place: int, level: int, x: float, y: float) -> tuple[float, float, float]:
    """How a source is seen from a point [m].

    Returns:
        Its distance; the distance of a panel's middle or of a corner's vertex; the half length of a panel or
        the length of a corner's legs, all [m].
    """
    corner = row(m, CORNERS, max(k, 0), 15)
    rx, ry = x - m[corner], y - m[corner + 1]
    if place >= 0:
        ax, ay, bx, by = panel_ends(m, k, place, level, x, y, rx, ry)
        middle = 0.5 * np.sqrt((ax + bx) ** 2 + (ay + by) ** 2)
        half = 0.5 * np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
        return point_distance(0.0, 0.0, ax, ay, bx, by), middle, half
    leg, nearest = m[corner + 8] * 0.5**level, np.inf
    for side in range(2):
        ax, ay = leg * m[corner + 2 + 2 * side] - rx, leg * m[corner + 3 + 2 * side] - ry
        nearest = min(nearest, point_distance(0.0, 0.0, ax, ay, -rx, -ry))
    return nearest, np.sqrt(rx * rx + ry * ry), leg


@compiled(reassociate=True)
def solved_nodes(m: FlatMap, k: int, place: int) -> tuple[int, int]:
    """Index range [first, end) of the solved nodes of a regular panel or of a corner's block."""
    if k >= 0:
        return integer(m, CORNER_INDEX, k, 7, 0), integer(m, CORNER_INDEX, k + 1, 7, 0)
    regular = integer(m, CORNER_INDEX, rows_of(m, CORNERS), 7, 0)
    count = (_row_length(m) - regular) // rows_of(m, PANELS)
    return regular + place * count, regular + (place + 1) * count


@compiled(reassociate=True)
def _row_length(m: FlatMap) -> int:
    """Number of solved nodes: the length of each of the six rows of sources."""
    return (row(m, CORNERS, 0, 15) - row(m, SOURCES, 0, 0)) // 6


@compiled(reassociate=True)
def gather(
    m: FlatMap, k: int, place: int, level: int, opened: bool, seen: tuple[float, float, float],
    x: float, y: float, radius: float, nodes: FloatArray,
) -> int:  # fmt: skip
    """Write the nodes of a source that is far from a box; return how many.

    The source is ``seen`` from the box's centre (x, y) [m]; ``radius`` is the half diagonal of the box [m],
    ``opened`` whether refined densities are known. The nodes are columns (position seen from the centre, line
    element, mu_u, mu_v), shape (6, .).
    """
    if (place < 0 and level == 0) or (k < 0 and (not opened or seen[1] - radius >= FAR * seen[2])):
        first, last = solved_nodes(m, k, place)
        sources, n = row(m, SOURCES, 0, 0), _row_length(m)
        for j in range(first, last):
            for i in range(6):
                nodes[i, j - first] = m[sources + i * n + j]
            nodes[0, j - first] -= x
            nodes[1, j - first] -= y
        return int(last - first)
    corner = row(m, CORNERS, max(k, 0), 15)
    if place < 0:
        return _gather_tail(m, k, level, m[corner] - x, m[corner + 1] - y, nodes)
    ax, ay, bx, by = panel_ends(m, k, place, level, x, y, x - m[corner], y - m[corner + 1])
    density = density_of(m, k, place, level)
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    for j in range(REFINED_NODES):
        nodes[0, j], nodes[1, j] = 0.5 * (ax + bx) + _GAUSS_X[j] * hx, 0.5 * (ay + by) + _GAUSS_X[j] * hy
        nodes[2, j], nodes[3, j] = _GAUSS_W[j] * hx, _GAUSS_W[j] * hy
        nodes[4, j], nodes[5, j] = m[density + 2 * j], m[density + 2 * j + 1]
    return REFINED_NODES


@compiled(reassociate=True)
def _gather_tail(m: FlatMap, k: int, level: int, x: float, y: float, nodes: FloatArray) -> int:
    """Write the nodes of a corner's compressed density at a level, its vertex at (x, y); return how many."""
    n, grid = integer(m, CORNER_INDEX, k, 7, 2), row(m, GRID, integer(m, CORNER_INDEX, k, 7, 3), 2)
    tail, corner = row(m, TAILS, integer(m, CORNER_INDEX, k, 7, 6) + 2 * level * n, 2), row(m, CORNERS, k, 15)
    scale = m[corner + 8] * 0.5**level
    for i in range(2 * n):
        leg, j = i // n, i % n
        dx, dy = scale * m[corner + 2 + 2 * leg], scale * m[corner + 3 + 2 * leg]
        s, w = m[grid + 2 * j], (2.0 * leg - 1.0) * m[grid + 2 * j + 1]
        nodes[0, i], nodes[1, i] = x + s * dx, y + s * dy
        nodes[2, i], nodes[3, i] = w * dx, w * dy
        nodes[4, i], nodes[5, i] = m[tail + 2 * i], m[tail + 2 * i + 1]
    return 2 * n
