"""Walls as polygons: curves on the safe side, strokes with their width."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, isfinite, sqrt
from typing import Literal

import numpy as np
from shapely import LinearRing, LineString
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FloorPlanError
from coop_drake.tree.arrays import FloatArray

# Turns Bézier curves into chords, with a bound on the distance of the curve from them.

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


# The lines of a drawing, each of them a wall: what the readers of drawings return.

_MOST_POINTS = 400_000
"""Points of a drawing from which finding its rooms would take hours."""


@dataclass(frozen=True)
class Wall:
    """One polyline; the curve that it replaces lies within its half width.

    Attributes:
        points: Shape (n, 2), in W [m].
        half_width: Half the thickness of the wall, zero for a thin line [m].
        closed: Whether the last point is joined to the first, which is not repeated then.
        place: Name of the element of the file, for messages.
        flat: Whether the wall ends where its line ends; otherwise half its width further on.
        mitre: How far from a corner the edges on either side are prolonged, over half the width [-]; from two
            on, round corners are enclosed.
        clip: What is seen of it, in W [m]; None for all.
    """

    points: FloatArray
    half_width: float
    closed: bool
    place: str
    flat: bool = False
    mitre: float = 2.0
    clip: BaseGeometry | None = None

    @property
    def coordinates(self) -> FloatArray:
        """All points in order, the first once more at the end of a closed wall, shape (m, 2) [m]."""
        return np.vstack([self.points, self.points[:1]]) if self.closed else self.points

    @property
    def body(self) -> BaseGeometry:
        """What is seen of the wall: an area, or the line where it has no width, in W [m]."""
        points = self.coordinates if len(self.points) > 1 else np.repeat(self.points, 2, axis=0)
        body: BaseGeometry = LinearRing(self.points) if self.closed else LineString(points)
        if self.half_width > 0.0:
            cap: Literal["flat", "square"] = "flat" if self.flat else "square"
            body = body.buffer(self.half_width, cap_style=cap, join_style="mitre", mitre_limit=self.mitre)
        return body if self.clip is None else body.intersection(self.clip)


@dataclass(frozen=True)
class Drawing:
    """The content of one drawing.

    Attributes:
        walls: All lines, in the file's order.
        notes: Sentences about what was left out or assumed.
    """

    walls: tuple[Wall, ...]
    notes: tuple[str, ...] = ()


def refuse_many(file: str, points: int) -> None:
    """Refuse files with more than ``_MOST_POINTS`` points by a FloorPlanError."""
    if points > _MOST_POINTS:
        raise FloorPlanError(
            file,
            "the lines",
            f"they have more than {_MOST_POINTS:,} points",
            "choose layers, or have the drawing program leave out what are no walls",
        )
