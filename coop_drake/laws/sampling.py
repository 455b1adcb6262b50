"""Times in control periods."""

from __future__ import annotations

from math import ceil

_ROUNDING = 1e-9
"""Share of a period by which a time may exceed whole periods and count as these [-]: decimal numbers such as
0.015 s have rounding errors that are far smaller, and no simulated delay is that short."""


def whole_periods(time: float, period: float) -> int:
    """Return the number of periods that a time takes, rounded up unless it is whole up to rounding errors.

    The simulation delays by it, and budgets count it, so that none is certified for a shorter delay.

    Args:
        time: The time [s].
        period: The control period [s].
    """
    return ceil(time / period - _ROUNDING)
