"""Convex polygons as sets of supporting lines ``n(angle) . x <= offset``: the arithmetic of all sweeps."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.pose import FloatArray

SLACK = 1e-9
"""Directed rounding [m]: outer offsets grow and inner offsets shrink by it."""


def following(ring: FloatArray) -> FloatArray:
    """Rotate a ring by one entry, so that entry i is what followed entry i; the shape (n, ...) stays."""
    return np.concatenate((ring[1:], ring[:1]))


def normals(angles: FloatArray) -> FloatArray:
    """Unit vectors at the angles; shape (k,) [rad] to (k, 2)."""
    result = np.empty((*angles.shape, 2))
    np.cos(angles, out=result[..., 0])
    np.sin(angles, out=result[..., 1])
    return result
