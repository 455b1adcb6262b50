"""The entries of the double layer between nodes of the boundary, with exact weights for near panels."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.nodes import Nodes
from coop_drake.fields.quadrature import legendre_transform
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray

NEAR = 4.3
"""|zeta - 1| + |zeta + 1| below which panels are integrated exactly, zeta the target in a panel's coordinate
[-]."""


class DoubleLayer(NamedTuple):
    """The data from which the entries of 2 K on the nodes of a boundary are computed.

    Entries of two nodes on one edge are exactly zero; so are, by convention, those of two nodes of one corner
    block, whose interaction is part of the block's compressed operator.

    Attributes:
        x: Nodes [m], shape (n,).
        y: Nodes [m], shape (n,).
        dx: Line element times weight, over pi [m], shape (n,).
        dy: Line element in y times weight, over pi [m], shape (n,).
        edge: Edge of each node, shape (n,).
        corner: Corner block of each node, -1 on regular panels, shape (n,).
        first: First node of the regular panels, shape (1,).
        pair_start: First near pair of each regular panel, and one more, shape (panels + 1,).
        pair_target: Node of each near pair, shape (pairs,).
        pair_weight: The weights that replace the kernel of its panel there, shape (pairs, nodes of a panel).
    """

    x: FloatArray
    y: FloatArray
    dx: FloatArray
    dy: FloatArray
    edge: IntArray
    corner: IntArray
    first: IntArray
    pair_start: IntArray
    pair_target: IntArray
    pair_weight: FloatArray


def double_layer(grid: Nodes, segments: ComplexArray, panel_edge: IntArray, nodes: int) -> DoubleLayer:
    """Prepare 2 K of a discretisation, with so many Gauss nodes on a panel.

    Segments are centre and half vector of each regular panel, shape (panels, 2).
    """
    start, target = _near_pairs(grid.position, grid.edge, segments, panel_edge)
    weight = _near_weights(grid.position, segments, start, target, legendre_transform(nodes))
    return DoubleLayer(
        x=grid.position.real.copy(),
        y=grid.position.imag.copy(),
        dx=grid.element.real / pi,
        dy=grid.element.imag / pi,
        edge=grid.edge,
        corner=grid.corner,
        first=grid.corner_start[-1:],
        pair_start=start,
        pair_target=target,
        pair_weight=weight,
    )


@compiled(reassociate=True)
def block(k: DoubleLayer, rows: IntArray, columns: IntArray, row_of: IntArray) -> FloatArray:
    """Entries of 2 K at ``rows``, the targets, x ``columns``, the sources, stored column by column.

    ``row_of`` is scratch of shape (n,), -1 throughout before and after.
    """
    m = len(rows)
    x, y, edge, corner = k.x[rows], k.y[rows], k.edge[rows], k.corner[rows]
    out = np.empty((len(columns), m))
    for b in range(len(columns)):
        j = columns[b]
        tx, ty, dx, dy, e = k.x[j], k.y[j], k.dx[j], k.dy[j], k.edge[j]
        c = k.corner[j] if k.corner[j] >= 0 else -2
        for a in range(m):
            rx, ry = tx - x[a], ty - y[a]
            value = (dy * rx - dx * ry) / (rx * rx + ry * ry)
            out[b, a] = 0.0 if edge[a] == e or corner[a] == c else value
    for a in range(m):
        row_of[rows[a]] = a
    first, p = k.first[0], k.pair_weight.shape[1]
    for b in range(len(columns)):
        j = columns[b] - first
        if j >= 0:
            for t in range(k.pair_start[j // p], k.pair_start[j // p + 1]):
                a = row_of[k.pair_target[t]]
                if a >= 0:
                    out[b, a] = k.pair_weight[t, j % p]
    for a in range(m):
        row_of[rows[a]] = -1
    return out.T


@compiled(reassociate=True)
def mark_near(
    k: DoubleLayer, own: IntArray, disc: tuple[float, float, float], row_of: IntArray
) -> tuple[np.ndarray, np.ndarray]:
    """Mark the nodes outside a set but not far from it: as sources on the set, and as its targets.

    These are the nodes in a disc (x, y, radius) around the set [m], and those whose entry with a node of the
    set has exact weights. ``row_of`` is scratch as for `block`.

    Returns:
        Masks of shape (n,), False on the set itself.
    """
    n = len(k.x)
    sources, targets = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    for i in range(n):
        rx, ry = k.x[i] - disc[0], k.y[i] - disc[1]
        sources[i] = targets[i] = rx * rx + ry * ry < disc[2] * disc[2]
    for i in own:
        row_of[i] = 0
    first, p = k.first[0], k.pair_weight.shape[1]
    for panel in range(len(k.pair_start) - 1):
        a, b = first + panel * p, first + (panel + 1) * p
        holds, struck = False, False
        for j in range(a, b):
            holds = holds or row_of[j] >= 0
        for t in range(k.pair_start[panel], k.pair_start[panel + 1]):
            struck = struck or row_of[k.pair_target[t]] >= 0
            if holds:
                targets[k.pair_target[t]] = True
        if struck:
            sources[a:b] = True
    for i in own:
        row_of[i] = -1
        sources[i] = targets[i] = False
    return sources, targets


def _near_pairs(
    target: ComplexArray, target_edge: IntArray, segments: ComplexArray, edge: IntArray
) -> tuple[IntArray, IntArray]:
    """Targets near each regular panel but not on its edge: where each panel's begin, and all of them."""
    start, found = np.zeros(len(segments) + 1, dtype=np.int64), np.empty(8 * len(target), dtype=np.int64)
    count = _find_near(target, target_edge, segments, edge, start, found)
    if count > len(found):
        found = np.empty(count, dtype=np.int64)
        _find_near(target, target_edge, segments, edge, start, found)
    return start, found[:count]


@compiled(reassociate=True)
def _find_near(
    target: ComplexArray, target_edge: IntArray, segments: ComplexArray, edge: IntArray,
    start: IntArray, found: IntArray,
) -> int:  # fmt: skip
    """Write the near pairs as far as there is room in ``found``; return how many there are."""
    end = 0
    for k in range(len(segments)):
        centre, half = segments[k, 0], segments[k, 1]
        reach = (0.5 * NEAR) ** 2 * (half.real**2 + half.imag**2)
        for i in range(len(target)):
            rx, ry = target[i].real - centre.real, target[i].imag - centre.imag
            if rx * rx + ry * ry < reach and target_edge[i] != edge[k]:
                zeta = (target[i] - centre) / half
                if abs(zeta - 1.0) + abs(zeta + 1.0) < NEAR:
                    if end < len(found):
                        found[end] = i
                    end += 1
        start[k + 1] = end
    return end


@compiled(reassociate=True)
def _near_weights(
    target: ComplexArray, segments: ComplexArray, start: IntArray, found: IntArray, transform: FloatArray
) -> FloatArray:
    """Exact weights of near panels for polynomial densities, shape (pairs, nodes)."""
    p = len(transform)
    moments, weights = np.empty(p), np.zeros((len(found), p))
    for k in range(len(segments)):
        for t in range(start[k], start[k + 1]):
            legendre_moments((target[found[t]] - segments[k, 0]) / segments[k, 1], moments)
            for degree in range(p):
                for j in range(p):
                    weights[t, j] += moments[degree] * transform[degree, j]
    return weights


@compiled(reassociate=True)
def legendre_moments(zeta: complex, out: FloatArray) -> None:
    """1/pi times the imaginary part of the integral of P_k(x) / (x - zeta) over [-1, 1], k from 0."""
    turn = np.arctan2(zeta.imag, zeta.real + 1.0) - np.arctan2(zeta.imag, zeta.real - 1.0)
    q0 = complex(0.5 * np.log(abs(zeta + 1.0) / abs(zeta - 1.0)), 0.5 * turn)
    q1 = zeta * q0 - 1.0
    out[0], out[1] = -2.0 / pi * q0.imag, -2.0 / pi * q1.imag
    for k in range(1, len(out) - 1):
        q0, q1 = q1, ((2 * k + 1) * zeta * q1 - k * q0) / (k + 1)
        out[k + 1] = -2.0 / pi * q1.imag
