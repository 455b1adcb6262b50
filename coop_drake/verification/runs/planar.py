"""Vectors of the plane in every row of a log."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.pose import FloatArray


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """The component out of the plane of the product of vectors (T, 2), shape (T,)."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def left(vectors: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by a right angle, counter-clockwise."""
    return np.column_stack((-vectors[:, 1], vectors[:, 0]))


def turned(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by angles (T,)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.column_stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]))
