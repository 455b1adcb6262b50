"""What comes of one attempt to sample a path and to cover it with boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.planning.boxes.certify import PathBox
from coop_drake.tree.pose import FloatArray

SAMPLES = 4_000
"""Samples for every subsystem in the first attempt; enough for most floors, at a tenth of a second."""

LIGHT_ATTEMPTS = 4
"""Attempts with few samples, before those with many begin."""

MANY_SAMPLES = 16_000
"""Samples for every subsystem in later attempts, about a second each."""

LARGEST_SHARE = 2
"""So many times as many are drawn at most [-]: twice as many take three times as long."""


@dataclass(frozen=True)
class BoxSequence:
    """Boxes along a path that are proved free; a channel without its polygons.

    Attributes:
        boxes: From the start's box to the goal's box.
        path: The path that they cover, circular axes unwrapped, shape (m, 3 + n) [m, rad].
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


def samples_of_attempt(number: int) -> int:
    """Samples for every subsystem in an attempt, counted from 1: few at first, then many."""
    if number <= LIGHT_ATTEMPTS:
        return SAMPLES * luby(number)
    return MANY_SAMPLES * min(luby(number - LIGHT_ATTEMPTS), LARGEST_SHARE)


def luby(number: int) -> int:
    """Luby's sequence of budgets for restarts, 1 1 2 1 1 2 4 and so on, counted from 1."""
    size = int(np.log2(number + 1))
    return 1 << size - 1 if number + 1 == 1 << size else luby(number + 1 - (1 << size))
