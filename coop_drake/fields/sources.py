"""What a boundary is made of, panels and corners, as sources seen from a point, in machine code.

A source is a row (corner, place, level) as in `MapArrays.near`.
"""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.layers import REFINED_NODES, MapArrays
from coop_drake.fields.near_field import ring_ends
from coop_drake.fields.panels import point_distance
from coop_drake.fields.quadrature import FloatArray, gauss_nodes

__all__ = ["FAR", "gather", "seen_from", "size"]

FAR = 2.2  # |zeta| from which the solved nodes of a panel do
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)


@compiled(reassociate=True)
def size(m: MapArrays, k: int, place: int, level: int) -> float:
    """Half length of a panel, length of a corner's legs [m]."""
    if k < 0:
        dx, dy = m.panels[place, 2] - m.panels[place, 0], m.panels[place, 3] - m.panels[place, 1]
        return 0.5 * float(np.sqrt(dx * dx + dy * dy))
    leg = float(m.corners[k, 8] * 0.5**level)
    if place < 0:
        return leg
    first = m.corner_index[k, 4] + place % m.corner_index[k, 1]
    return 0.5 * leg * float(m.breaks[first + 1] - m.breaks[first])


@compiled(reassociate=True)
def seen_from(m: MapArrays, k: int, place: int, level: int, x: float, y: float) -> tuple[float, float, float]:
    """Distance of a panel or corner from a point, distance of its middle or vertex, half length or leg."""
    if k < 0:
        ax, ay = m.panels[place, 0] - x, m.panels[place, 1] - y
        bx, by = m.panels[place, 2] - x, m.panels[place, 3] - y
    elif place >= 0:
        rx, ry = x - m.corners[k, 0], y - m.corners[k, 1]
        ax, ay, bx, by = ring_ends(m, k, level, place, x, y, rx, ry)
    else:
        rx, ry, leg = m.corners[k, 0] - x, m.corners[k, 1] - y, m.corners[k, 8] * 0.5**level
        ax, ay, bx, by = rx + leg * m.corners[k, 2], ry + leg * m.corners[k, 3], rx, ry
        cx, cy = rx + leg * m.corners[k, 4], ry + leg * m.corners[k, 5]
        nearest = min(point_distance(0.0, 0.0, ax, ay, bx, by), point_distance(0.0, 0.0, bx, by, cx, cy))
        return nearest, np.sqrt(rx * rx + ry * ry), leg
    middle = 0.5 * np.sqrt((ax + bx) ** 2 + (ay + by) ** 2)
    return point_distance(0.0, 0.0, ax, ay, bx, by), middle, 0.5 * np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)


@compiled(reassociate=True)
def gather(
    m: MapArrays, k: int, place: int, level: int, opened: bool, seen: tuple[float, float, float],
    x: float, y: float, radius: float, nodes: FloatArray,
) -> int:  # fmt: skip
    """Write sources as rows (position seen from the point, line element, mu_u, mu_v); how many."""
    solved = (place < 0 and level == 0) or (k < 0 and (not opened or seen[1] - radius >= FAR * seen[2]))
    if solved:
        first, last = m.corner_index[k, 0], m.corner_index[k + 1, 0]
        if k < 0:
            first = m.corner_index[-1, 0]
            per_panel = (m.sources.shape[1] - first) // len(m.panels)
            first, last = first + place * per_panel, first + (place + 1) * per_panel
        for j in range(first, last):
            nodes[0, j - first], nodes[1, j - first] = m.sources[0, j] - x, m.sources[1, j] - y
            for row in range(2, 6):
                nodes[row, j - first] = m.sources[row, j]
        return int(last - first)
    if place < 0:
        return _gather_tail(m, k, level, x, y, nodes)
    if k < 0:
        ax, ay = m.panels[place, 0] - x, m.panels[place, 1] - y
        bx, by = m.panels[place, 2] - x, m.panels[place, 3] - y
        density = m.panel_density[place, 0]
    else:
        ax, ay, bx, by = ring_ends(m, k, level, place, x, y, x - m.corners[k, 0], y - m.corners[k, 1])
        density = m.rings[m.corner_index[k, 5] + 2 * level * m.corner_index[k, 1] + place, 0]
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    for j in range(REFINED_NODES):
        nodes[0, j], nodes[1, j] = 0.5 * (ax + bx) + _GAUSS_X[j] * hx, 0.5 * (ay + by) + _GAUSS_X[j] * hy
        nodes[2, j], nodes[3, j] = _GAUSS_W[j] * hx, _GAUSS_W[j] * hy
        nodes[4, j], nodes[5, j] = density[j, 0], density[j, 1]
    return REFINED_NODES


@compiled(reassociate=True)
def _gather_tail(m: MapArrays, k: int, level: int, x: float, y: float, nodes: FloatArray) -> int:
    """The same for a corner's compressed density at a level."""
    n, grid, first = m.corner_index[k, 2], m.corner_index[k, 3], m.corner_index[k, 6]
    scale = m.corners[k, 8] * 0.5**level
    for leg in range(2):
        dx, dy = scale * m.corners[k, 2 + 2 * leg], scale * m.corners[k, 3 + 2 * leg]
        for j in range(n):
            s, w = m.grid[grid + j, 0], (2.0 * leg - 1.0) * m.grid[grid + j, 1]
            i, row = leg * n + j, first + (2 * level + leg) * n + j
            nodes[0, i], nodes[1, i] = m.corners[k, 0] + s * dx - x, m.corners[k, 1] + s * dy - y
            nodes[2, i], nodes[3, i] = w * dx, w * dy
            nodes[4, i], nodes[5, i] = m.tails[row, 0], m.tails[row, 1]
    return 2 * int(n)
