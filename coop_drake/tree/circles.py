"""Circular axes: theta and every joint without limits, on which values that differ by whole turns are one."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from coop_drake.tree.pose import FloatArray


def nearest_turn(angle: float) -> float:
    """The same angle modulo 2 pi in [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi


def whole_turns(values: FloatArray, near: FloatArray) -> FloatArray:
    """Whole turns that bring angles nearest to others, exactly zero where they are; any shape [rad]."""
    return 2.0 * pi * np.rint((near - values) / (2.0 * pi))


def turns_to(values: Sequence[float], near: Sequence[float], circular: Sequence[bool]) -> FloatArray:
    """Whole turns that bring values of axes nearest to others; zero on axes that are no circles.

    Args:
        values: Values of (theta, q...), length 1 + n [rad, m].
        near: Others.
        circular: Which axes are circles.

    Returns:
        What to add to the values, shape (1 + n,) [rad, m].
    """
    both = zip(values, near, circular, strict=True)
    return np.array([there + nearest_turn(here - there) - here if on else 0.0 for here, there, on in both])
