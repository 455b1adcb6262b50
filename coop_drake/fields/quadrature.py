"""Gauss-Legendre panels on [-1, 1]: nodes, weights, interpolation and Legendre coefficients."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre

from coop_drake.tree.pose import FloatArray


@cache
def gauss_nodes(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights, each of shape (count,), that integrate polynomials of degree 2 count - 1 exactly."""
    nodes, weights = legendre.leggauss(count)
    return nodes, weights


@cache
def legendre_transform(count: int) -> FloatArray:
    """Matrix (count, count) from values at the Gauss nodes to Legendre coefficients, lowest degree first."""
    nodes, weights = gauss_nodes(count)
    degrees = np.arange(count)
    return (degrees[:, None] + 0.5) * legendre.legvander(nodes, count - 1).T * weights


def interpolation(count: int, points: FloatArray) -> FloatArray:
    """Matrix (n, count) from values at the Gauss nodes to the interpolant's values at ``points`` (n,)."""
    return legendre.legvander(points, count - 1) @ legendre_transform(count)
