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


_LATE = 1e-6
"""Share of a period by which a sample may seem to be early [-]: times of samples are multiples of the period
up to rounding errors, which are far smaller."""


def period_of(time: float, period: float, offset: float = 0.0) -> int:
    """Return the number of the control period that a time is in, 0 for the first one.

    Args:
        time: The time [s].
        period: The control period [s].
        offset: When the first period begins [s].
    """
    return max(int((time - offset) / period + _LATE), 0)
