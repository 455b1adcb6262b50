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
    """

    def __init__(self, period: float) -> None:
        self._samples: deque[FloatArray] = deque(maxlen=whole_periods(MEAN_TIME, period))

    def restart(self) -> None:
        """Forget all samples."""
        self._samples.clear()

    def sees_rest(self, rates: FloatArray) -> bool:
        """Take in a sample; return whether the mean of no rate exceeds ``RATE_TOLERANCE`` over the window.

        Args:
            rates: All rates that count [m/s or rad/s].
        """
        self._samples.append(np.array(rates))
        full = len(self._samples) == self._samples.maxlen
        return full and bool(np.abs(np.mean(self._samples, axis=0)).max() <= RATE_TOLERANCE)
