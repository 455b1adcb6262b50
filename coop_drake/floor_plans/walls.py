"""The lines of a drawing, each of them a wall: what the readers of drawings return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from shapely import LinearRing, LineString
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FloorPlanError
from coop_drake.tree.pose import FloatArray

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
