"""Turns Bézier curves into chords, with a bound on the distance of the curve from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import ceil, isfinite, sqrt

import numpy as np

from coop_drake.tree.pose import FloatArray

_ARC_ERROR = 3e-4
"""Error of a cubic that stands for a quarter of a circle: 2.8e-4 of the radius, as a fraction of its size
[-]."""

_MOST_CHORDS = 5_000
"""Chords for one curve at most; the bound on the distance accounts for a curve that would need more."""


def flatten(
    pieces: Iterable[Sequence[Sequence[float]] | FloatArray], sagitta: float, *, from_arcs: bool = False
) -> tuple[FloatArray, float]:
    """Join lines and Bézier curves that follow each other into one polyline.

    A chord over a step of h lies within h^2 / 8 of the largest second derivative.

    Args:
        pieces: Control points of each piece, two to four, each (x, y) [m]; each starts where the last ended.
        sagitta: Largest distance of a chord from its curve [m].
        from_arcs: Whether the curves may be approximations of circular or elliptical arcs.

    Returns:
        The polyline, shape (n, 2) [m], and a bound on the distance of the drawn curve from it [m].
    """
    points: list[FloatArray] = []
    strays = 0.0
    for piece in pieces:
        control = np.asarray(piece, dtype=float)
        if not points:
            points.append(control[:1])
        if len(control) == 2:
            points.append(control[1:])
            continue
        bound = _second_derivative(control)
        chords = min(_MOST_CHORDS, max(1, ceil(sqrt(bound / (8.0 * sagitta))))) if isfinite(bound) else 1
        points.append(_at(control, np.arange(1, chords + 1) / chords))
        size = float(np.hypot(*np.ptp(control, axis=0)))
        strays = max(strays, bound / (8.0 * chords**2) + (_ARC_ERROR * size if from_arcs else 0.0))
    return np.vstack(points), strays


def _second_derivative(control: FloatArray) -> float:
    """A bound on the length of the second derivative with respect to the parameter in [0, 1] [m]."""
    degree = len(control) - 1
    bends = np.linalg.norm(np.diff(control, n=2, axis=0), axis=1)
    return float(degree * (degree - 1) * bends.max())


def _at(control: FloatArray, t: FloatArray) -> FloatArray:
    """Points of the curve by de Casteljau's scheme, shape (n, 2); the last is the last control point."""
    layer = np.repeat(control[None], len(t), axis=0)
    while layer.shape[1] > 1:
        layer = layer[:, :-1] + t[:, None, None] * (layer[:, 1:] - layer[:, :-1])
    layer[-1, 0] = control[-1]
    return layer[:, 0]
