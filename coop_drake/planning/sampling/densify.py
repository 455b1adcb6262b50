"""Samples added to a path, so that neighbours are near to each other."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.pose import FloatArray

__all__ = ["densified"]


def densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """A path with samples added, so that neighbours are at most a step apart in every scaled axis.

    Args:
        path: Configurations, shape (k, d).
        scale: How far a unit of each axis moves the team, shape (d,).
        step: The distance [m].

    Returns:
        Configurations, shape (m, d), those of the path among them.
    """
    if len(path) < 2:
        return path.copy()
    moved = np.abs(np.diff(path, axis=0) * scale).max(axis=1)
    parts = np.maximum(1, np.ceil(moved / step)).astype(int)
    rows = np.repeat(np.arange(len(parts)), parts)
    fraction = (np.arange(len(rows)) - np.repeat(np.cumsum(parts) - parts, parts) + 1.0) / parts[rows]
    dense: FloatArray = path[rows] + fraction[:, None] * (path[rows + 1] - path[rows])
    return np.concatenate((path[:1], dense))
