"""Corner operators: the double layer near a corner, compressed to a few nodes for each angle.

The kernel of two straight legs depends on the ratio of distances alone, so the density near a corner obeys
the same equation at every scale. Recursive compression (Helsing and Ojala, 2008) turns that into a fixed
point R = Z + U R (I - X R)^-1 V, which doubling reaches in a few steps: each composes the map with itself.
By mirror symmetry of the legs everything splits into an even and an odd part.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, cos, log, log1p, pi, sin

import numpy as np

from coop_drake.fields.quadrature import gauss_nodes, interpolation
from coop_drake.tree.pose import FloatArray

_BROAD = 4.0 * pi / 9.0  # gap between the legs from which one panel resolves the other leg at every scale
_DOUBLINGS = 7  # 2^7 dyadic levels: what the next would add is below rounding for every angle


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
        matrix[rows, k * nodes : (k + 1) * nodes] = interpolation(nodes, local)
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
