"""Whether something rests, by the mean of its measured rates, which have noise."""

from __future__ import annotations

from collections import deque

import numpy as np

from coop_drake.laws.arrival import MEAN_TIME
from coop_drake.laws.readiness import RATE_TOLERANCE
from coop_drake.laws.sampling import whole_periods
from coop_drake.tree.pose import FloatArray


class Stillness:
    """Keeps the last samples over ``MEAN_TIME``.

    Args:
        period: Time between two samples [s].
        lasting: For how long rest must have been seen without a break [s]; what swings rests at its turning
            points, too.
    """

    def __init__(self, period: float, lasting: float = 0.0) -> None:
        self._needed, self._rested = whole_periods(lasting, period), 0
        self._samples: deque[FloatArray] = deque(maxlen=whole_periods(MEAN_TIME, period))
        self._seen: deque[FloatArray] = deque(maxlen=self._samples.maxlen)

    def restart(self) -> None:
        """Forget all samples."""
        self._rested = 0
        self._samples.clear()
        self._seen.clear()

    @property
    def full(self) -> bool:
        """Whether samples over the whole window have been seen."""
        return len(self._samples) == self._samples.maxlen

    def sees_rest(self, rates: FloatArray, seen: FloatArray | None = None) -> bool:
        """Take in a sample; return whether the mean of no rate exceeds ``RATE_TOLERANCE`` over the window.

        Args:
            rates: All rates that count [m/s or rad/s].
            seen: What :meth:`mean` averages.
        """
        self._samples.append(np.array(rates))
        if seen is not None:
            self._seen.append(np.array(seen))
        rests = self.full and bool(np.abs(np.mean(self._samples, axis=0)).max() <= RATE_TOLERANCE)
        self._rested = self._rested + 1 if rests else 0
        return self._rested > self._needed

    def mean(self) -> FloatArray:
        """Return the mean of what was seen over the window."""
        mean: FloatArray = np.mean(self._seen, axis=0)
        return mean
