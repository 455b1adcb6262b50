"""The density on finer nodes: the integral equation, solved on coarse ones, interpolates itself."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.density import Density
from coop_drake.fields.double_layer import NEAR, legendre_moments
from coop_drake.fields.far_field import far_field, leaf_at
from coop_drake.fields.layers import REFINED_NODES, MapArrays
from coop_drake.fields.nodes import Nodes, place_nodes
from coop_drake.fields.outline import ComplexArray, IntArray, Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import FloatArray, legendre_transform

__all__ = ["refine"]


def refine(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float, m: MapArrays
) -> tuple[Nodes, FloatArray]:
    """Nystrom interpolation of a density to `REFINED_NODES` nodes a panel.

    Args:
        outline: The rings.
        panels: Where they are cut.
        angles: Interior angle of each corner [rad], shape (corners,).
        density: The solution.
        closeness: Longest panel per unit of distance, see `leg_panels`.
        m: The solved nodes in boxes, corners not opened.

    Returns:
        The finer nodes, and on them: the density on regular panels, on corner blocks the field that comes in
        from the rest of the boundary, shape (n, 2).
    """
    refined = place_nodes(outline, panels, angles, REFINED_NODES, closeness)
    images = np.vstack((np.zeros((1, 2)), density.hole_images))
    given = np.column_stack((refined.boundary_value.real, refined.boundary_value.imag))
    incoming = 2.0 * (given + images[outline.ring[refined.edge]])
    solved = density.weighted[density.nodes.corner_start[-1] :]
    nodes = max(len(solved) // max(len(panels.edge), 1), 1)
    coefficients = legendre_transform(nodes) @ solved.reshape(len(panels.edge), nodes, 2)
    _subtract(
        m, density.nodes.edge, np.ascontiguousarray(coefficients),
        refined.position, refined.edge, refined.corner, incoming,
    )  # fmt: skip
    return refined, incoming


@compiled(reassociate=True)
def _subtract(
    m: MapArrays, edge: IntArray, coefficients: FloatArray,
    target: ComplexArray, target_edge: IntArray, target_corner: IntArray, out: FloatArray,
) -> None:  # fmt: skip
    """Subtract 2 K density, by the same rules as between the solved nodes.

    Args:
        m: The solved nodes in boxes.
        edge: Edge of each solved node.
        coefficients: Legendre coefficients of the density of regular panels, shape (panels, nodes, 2).
        target: Where, shape (n,).
        target_edge: Edge of each target.
        target_corner: Corner block of each target, -1 on regular panels.
        out: Where the result is subtracted from, shape (n, 2).
    """
    p, regular = coefficients.shape[1], m.corner_index[-1, 0]
    moments = np.empty(max(p, 2))
    for i in range(len(target)):
        x, y = target[i].real, target[i].imag
        leaf = leaf_at(m, x, y)
        u, v, _, _, _, _ = far_field(m, leaf, x, y)
        for item in range(m.near_start[leaf], m.near_start[leaf + 1]):
            k, place = m.near[item, 0], m.near[item, 1]
            if k == target_corner[i] and k >= 0:
                continue
            first = m.corner_index[k, 0] if k >= 0 else regular + place * p
            last = m.corner_index[k + 1, 0] if k >= 0 else first + p
            if k < 0:
                if edge[first] == target_edge[i]:
                    continue
                ax, ay, bx, by = (
                    m.panels[place, 0],
                    m.panels[place, 1],
                    m.panels[place, 2],
                    m.panels[place, 3],
                )
                zeta = complex(2.0 * x - ax - bx, 2.0 * y - ay - by) / complex(bx - ax, by - ay)
                if abs(zeta - 1.0) + abs(zeta + 1.0) < NEAR:
                    legendre_moments(zeta, moments)
                    for degree in range(p):
                        u += pi * moments[degree] * coefficients[place, degree, 0]
                        v += pi * moments[degree] * coefficients[place, degree, 1]
                    continue
            du, dv = _direct(m.sources, edge, first, last, x, y, target_edge[i])
            u, v = u + du, v + dv
        out[i, 0] -= u / pi
        out[i, 1] -= v / pi


@compiled(reassociate=True)
def _direct(
    s: FloatArray, edge: IntArray, first: int, last: int, x: float, y: float, own: int
) -> tuple[float, float]:
    """Sum over solved nodes but those of one edge."""
    u, v = 0.0, 0.0
    for j in range(first, last):
        rx, ry = s[0, j] - x, s[1, j] - y
        value = (s[3, j] * rx - s[2, j] * ry) / (rx * rx + ry * ry)
        value = 0.0 if edge[j] == own else value
        u += value * s[4, j]
        v += value * s[5, j]
    return u, v
