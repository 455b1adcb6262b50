"""Checks points that users pass: arrays whose last axis is x, y."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from coop_drake.errors import FieldError
from coop_drake.tree.pose import FloatArray


def as_points(points: ArrayLike) -> FloatArray:
    """Points as an array of floats, shape (..., 2) [m].

    Raises:
        FieldError: If the last axis is not x, y, or a coordinate is not a finite number.
    """
    try:
        p = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise FieldError(f"points must be numbers of shape (..., 2), got {type(points).__name__}") from error
    if p.ndim == 0 or p.shape[-1] != 2:
        raise FieldError(f"points must have shape (..., 2), got {p.shape}")
    # The sum is quicker than a flag for each: it is finite unless a coordinate is not, or it overflows.
    total = sum(p.tolist()) if p.ndim == 1 else p.sum()
    if not isfinite(total) and not np.isfinite(p).all():
        first = np.argwhere(~np.isfinite(p).all(axis=-1))[0].tolist()
        raise FieldError(f"points must be finite, but point {first or 0} is {p[tuple(first)].tolist()}")
    return p
