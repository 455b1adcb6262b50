"""Interpolates the density to finer nodes by the integral equation itself (Nystrom interpolation)."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.density import Density
from coop_drake.fields.double_layer import NEAR, legendre_moments
from coop_drake.fields.far_field import far_field, leaf_at
from coop_drake.fields.flat_map import NEAR as NEAR_SOURCES
from coop_drake.fields.flat_map import (
    NEAR_START,
    REFINED_NODES,
    SOURCES,
    FlatMap,
    MapArrays,
    flatten,
    integer,
    row,
)
from coop_drake.fields.near_field import panel_ends
from coop_drake.fields.nodes import Nodes, place_nodes
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import legendre_transform
from coop_drake.fields.sources import solved_nodes
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray


def refine(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float, m: MapArrays
) -> tuple[Nodes, FloatArray]:
    """Interpolate a density to `REFINED_NODES` nodes on a panel; arguments as in `place_nodes`.

    The map ``m`` has the solved nodes in the leaves of its quadtree, corners not opened.

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
        flatten(m, np.zeros(2), 0.0), density.nodes.edge, np.ascontiguousarray(coefficients),
        refined.position, refined.edge, refined.corner, incoming,
    )  # fmt: skip
    return refined, incoming


@compiled(reassociate=True)
def _subtract(
    m: FlatMap, edge: IntArray, coefficients: FloatArray,
    target: ComplexArray, target_edge: IntArray, target_corner: IntArray, out: FloatArray,
) -> None:  # fmt: skip
    """Subtract 2 K density at targets, shape (n,) [m], by the same rules as between the solved nodes.

    ``edge`` is that of each solved node; the density of regular panels comes as Legendre coefficients, shape
    (panels, nodes, 2); corner blocks of targets are -1 on regular panels.
    """
    p = coefficients.shape[1]
    moments = np.empty(max(p, 2))
    for i in range(len(target)):
        x, y = target[i].real, target[i].imag
        leaf = leaf_at(m, x, y)
        total = far_field(m, leaf, x, y)
        u, v = total[0], total[1]
        for item in range(integer(m, NEAR_START, leaf, 1, 0), integer(m, NEAR_START, leaf + 1, 1, 0)):
            k, place = integer(m, NEAR_SOURCES, item, 3, 0), integer(m, NEAR_SOURCES, item, 3, 1)
            if k == target_corner[i] and k >= 0:
                continue
            first, last = solved_nodes(m, k, place)
            if k < 0:
                if edge[first] == target_edge[i]:
                    continue
                ax, ay, bx, by = panel_ends(m, k, place, 0, x, y, x, y)
                zeta = -complex(ax + bx, ay + by) / complex(bx - ax, by - ay)
                if abs(zeta - 1.0) + abs(zeta + 1.0) < NEAR:
                    legendre_moments(zeta, moments)
                    for degree in range(p):
                        u += pi * moments[degree] * coefficients[place, degree, 0]
                        v += pi * moments[degree] * coefficients[place, degree, 1]
                    continue
            s, n = row(m, SOURCES, 0, 0), len(edge)
            for j in range(s + first, s + last):
                rx, ry = m[j] - x, m[j + n] - y
                value = (m[j + 3 * n] * rx - m[j + 2 * n] * ry) / (rx * rx + ry * ry)
                value = 0.0 if edge[j - s] == target_edge[i] else value
                u += value * m[j + 4 * n]
                v += value * m[j + 5 * n]
        out[i, 0] -= u / pi
        out[i, 1] -= v / pi
