"""Lines that a drawing holds, each of them a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.tree.pose import FloatArray

__all__ = ["Drawing", "Wall", "refuse_many"]

_MOST_POINTS = 400_000


@dataclass(frozen=True)
class Wall:
    """One polyline; what it was flattened from lies within its half width.

    Attributes:
        points: Shape (n, 2), in W [m].
        half_width: How far the wall reaches to both sides; zero for a line [m].
        closed: Whether the last point is joined to the first; then they are not repeated.
        place: Which element of the file it is, in words.
    """

    points: FloatArray
    half_width: float
    closed: bool
    place: str

    @property
    def coordinates(self) -> FloatArray:
        """All points in order, the first once more at the end of a closed wall, shape (m, 2) [m]."""
        return np.vstack([self.points, self.points[:1]]) if self.closed else self.points


@dataclass(frozen=True)
class Drawing:
    """What was read from one file.

    Attributes:
        walls: All lines, in the file's order.
        notes: What was left out or taken for granted, in words.
    """

    walls: tuple[Wall, ...]
    notes: tuple[str, ...] = ()


def refuse_many(file: str, points: int) -> None:
    """Refuse files that would take hours.

    Raises:
        FloorPlanError: There are too many points.
    """
    if points > _MOST_POINTS:
        raise FloorPlanError(
            file,
            "the lines",
            f"they have more than {_MOST_POINTS:,} points",
            "choose layers, or have the drawing program leave out what are no walls",
        )
