"""The pace of the wall clock, and the ages of commands that are measured by it."""

from __future__ import annotations

import time as clocks
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Ages:
    """Ages of what commands were computed from, when they came back to the world [s].

    Attributes:
        count: Number of commands.
        median: Half of them are younger.
        high: 99.9 % of them are younger.
        largest: The oldest.
        late: How many were older than is allowed.
        allowed: Largest age that is allowed.
        slipped: By how much the run took longer than its simulated time.
    """

    count: int
    median: float
    high: float
    largest: float
    late: int
    allowed: float
    slipped: float


class Pacing:
    """Lets samples begin no earlier than by the wall clock, and collects ages.

    The world measures them by its own clock alone, from the question to the answer, so that clocks of other
    machines do not matter.

    Args:
        allowed: Largest age that is allowed [s].
    """

    def __init__(self, allowed: float) -> None:
        self.allowed, self._ages = allowed, list[float]()
        self._start: float | None = None
        self._slipped = 0.0

    def wait(self, time: float) -> None:
        """Wait until the wall clock has reached a simulated time [s]; a run that is late stays late."""
        now = clocks.monotonic()
        if self._start is None:
            self._start = now - time
        left = self._start + time - now
        if left > 0.0:
            clocks.sleep(left)
        else:
            self._start -= left
            self._slipped -= left

    def note(self, age: float) -> None:
        """Note the age of a command [s]."""
        self._ages.append(age)

    def ages(self) -> Ages:
        """Return what was measured."""
        ages = np.array(self._ages or [0.0])
        return Ages(
            len(self._ages),
            float(np.median(ages)),
            float(np.quantile(ages, 0.999)),
            float(ages.max()),
            int((ages > self.allowed).sum()),
            self.allowed,
            self._slipped,
        )
