"""The harmonic map of a rectangle by separation of variables: exact up to the truncated series."""

from __future__ import annotations

import numpy as np


def rectangle_map(width: float, height: float, points: np.ndarray, *, terms: int = 400) -> np.ndarray:
    """T at interior points (n, 2) of [0, width] x [0, height], the boundary angle 0 at the origin.

    The series of each side decays like exp(-n pi distance / side) in the distance from that side.
    """
    x, y = points.T
    rate = np.pi / (width + height)
    T = np.zeros(len(points), dtype=complex)
    # Side, its length, its angle at the start, coordinate along it, distance from it, extent across it.
    sides = (
        (width, 0.0, x, y, height),
        (height, rate * width, y, width - x, width),
        (width, np.pi, width - x, height - y, height),
        (height, np.pi + rate * width, height - y, x, width),
    )
    n = np.arange(1, terms + 1)[:, None]
    for length, start, along, across, extent in sides:
        k = n * np.pi / length
        # 2/L times the integral over (0, L) of exp(i (start + rate s)) sin(k s).
        coefficient = 2 / length * np.exp(1j * start) * k * (1 - (-1.0) ** n * np.exp(1j * rate * length))
        coefficient = coefficient / (k**2 - rate**2)
        decay = np.exp(-k * across) * (1 - np.exp(-2 * k * (extent - across))) / (1 - np.exp(-2 * k * extent))
        T += (coefficient * np.sin(k * along) * decay).sum(axis=0)
    return np.column_stack((T.real, T.imag))
