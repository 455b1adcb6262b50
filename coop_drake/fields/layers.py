"""Everything that evaluates one solved map, as flat arrays for the kernels of `evaluation`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.fields.quadrature import FloatArray

__all__ = ["INSIDE", "LEVELS", "ON_BOUNDARY", "ORDER", "OUTSIDE", "REFINED_NODES", "MapArrays"]

REFINED_NODES = 20  # nodes on a panel after the Nystrom interpolation
ORDER = 28  # terms of the power series
ON_BOUNDARY, INSIDE, OUTSIDE = 0, 1, 2  # of a leaf of the quadtree
LEVELS = 44  # dyadic rings kept at each corner: down to 6e-14 of its legs


class MapArrays(NamedTuple):
    """Flat arrays of a map.

    Attributes:
        edges: Rows (x0, y0, x1, y1), shape (edges, 4).
        sources: Rows x, y, dx, dy, mu_u, mu_v of the solved nodes, shape (6, n).
        corners: Rows (vertex, back, out, inward bisector as x y, leg, ends of the incoming and the outgoing
            leg as x y, image), shape (corners, 15). Panels share their ends with these to the last bit.
        corner_index: Rows (first source, ring panels m, leg nodes n, first grid node, first ring break,
            first ring, first tail), shape (corners + 1, 7).
        grid: Rows (distance, weight) of leg grids scaled to [0, 1].
        breaks: Ring breakpoints scaled to [1/2, 1].
        rings: Values then Legendre coefficients of the density on ring panels, shape (., 2, REFINED, 2).
        tails: Weight-corrected density of the legs at every level, shape (., 2).
        panels: Rows (start, end) as x y of regular panels, shape (panels, 4).
        panel_density: As ``rings`` for regular panels, shape (panels, 2, REFINED, 2).
        root: Centre and half side of the square that the quadtree divides, shape (3,).
        box_child: First of the four quarters of each box, -1 for leaves, shape (boxes,).
        box_leaf: Leaf that each box is, -1 for divided ones, shape (boxes,).
        leaf_square: Centre and half diagonal of each leaf, shape (leaves, 3).
        leaf_state: `ON_BOUNDARY`, `INSIDE` or `OUTSIDE`, shape (leaves,).
        local: Power series in units of the half diagonal of what is far from each leaf: rows of real and
            imaginary parts for u and for v, shape (leaves, ORDER, 4).
        near_start: First row of each leaf in ``near``, and the end, shape (leaves + 1,).
        near: Rows of what is near: (-1, k, 0) regular panel k, (k, j, level) panel j of a ring of corner k,
            (k, -1, level) all of corner k from a level down.
    """

    edges: FloatArray
    sources: FloatArray
    corners: FloatArray
    corner_index: np.ndarray
    grid: FloatArray
    breaks: FloatArray
    rings: FloatArray
    tails: FloatArray
    panels: FloatArray
    panel_density: FloatArray
    root: FloatArray
    box_child: np.ndarray
    box_leaf: np.ndarray
    leaf_square: FloatArray
    leaf_state: np.ndarray
    local: FloatArray
    near_start: np.ndarray
    near: np.ndarray
