"""What comes of one attempt to sample a path and to cover it with boxes."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.planning.boxes.certify import PathBox
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class BoxSequence:
    """Boxes along a path that are proved free; a channel without its polygons.

    Attributes:
        boxes: From the start's box to the goal's box.
        path: The path that they cover, theta unwrapped, shape (m, 3 + n) [m, rad].
        margin: The margin that the path's positions keep in every box [m].
    """

    boxes: tuple[PathBox, ...]
    path: FloatArray
    margin: float


@dataclass(frozen=True)
class Tried:
    """What comes of one attempt.

    Attributes:
        found: Boxes along its path, if they cover it.
        path: The path, None if there is none, shape (m, 3 + n) [m, rad].
        blocked: Whether no path was found even for the object alone; None if that is unknown.
        failed: Whether geometry failed.
        trials: Boxes tried.
        short: How far walls have to be moved back for the path; zero or less if it fits the floor [m].
    """

    found: BoxSequence | None = None
    path: FloatArray | None = None
    blocked: bool | None = None
    failed: bool = False
    trials: int = 0
    short: float = 0.0
