"""The result of another sampling planner, and the settings that all of them share."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.tree.pose import FloatArray

__all__ = ["GOALS", "MOTION_STEP", "RANGE", "PeerRun"]

MOTION_STEP = 0.03
"""No axis moves the team further than this between two checks of a motion, as in our sampler [m]."""
RANGE = 1.2
"""Longest step of a tree, as in our sampler; OMPL's own choice, a fifth of the space, is far worse [m]."""
GOALS = 24
"""Goal configurations that a peer may end in, as many as our sampler takes."""


@dataclass(frozen=True)
class PeerRun:
    """One run of another planner.

    Attributes:
        seed: Its seed.
        cpu_seconds: CPU time until it found a path or gave up.
        path: Configurations from start to goal, theta unwrapped, shape (m, 3 + n); no rows if none was found.
        checks: Configurations that it had checked.
        check_seconds: CPU time that these checks took together, None where that is not measured.
    """

    seed: int
    cpu_seconds: float
    path: FloatArray
    checks: int
    check_seconds: float | None = None

    @property
    def found(self) -> bool:
        """Whether it claims a path."""
        return len(self.path) > 0
