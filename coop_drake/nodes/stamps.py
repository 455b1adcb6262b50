"""Whether measurements are as old as the plan's budget counts on, by when they were measured."""

from __future__ import annotations

from math import inf

from coop_drake.answers.budget import Budget
from coop_drake.laws.sampling import whole_periods

_ROUNDING = 1e-6
"""Differences of times that are no difference [s]."""

_SLEWED = 1e-3
"""By how much a clock may be corrected while it runs, over the time that passes [-]."""


def certified_age(budget: Budget | None) -> float:
    """Return the largest age of measurements for which a plan holds [s]; infinite without a budget."""
    return (
        inf
        if budget is None
        else whole_periods(budget.delay, budget.period) * budget.period + budget.age_error
    )


class StampCheck:
    """Compares the stamps of one robot's measurements with its clock.

    A plan holds for measurements that are as old as robots take them for, but for what the error of their
    clocks hides, and with this error no older than its budget allows. Plans without a budget promise nothing,
    and nothing is compared.

    Args:
        period: Control period [s].
        budget: The plan's budget.
        age: How old the robot takes its measurements for [s].
    """

    def __init__(self, period: float, budget: Budget | None, age: float) -> None:
        self._period, self._age, self._compares = period, age, budget is not None
        self._error = 0.0 if budget is None else budget.clock_error
        self._oldest = certified_age(budget) - self._error
        self._last: tuple[int, float, tuple[float, float]] | None = None

    def doubts(self, number: int, time: float, stamps: tuple[float, float]) -> bool:
        """Whether a measurement is older or younger than it may be, or a clock or a stamp has jumped.

        Args:
            number: Number of the sample.
            time: What the robot's clock shows [s].
            stamps: When the object's pose and the robot's state were measured [s].
        """
        if not self._compares:
            return False
        before, self._last = self._last, (number, time, stamps)
        for stamp in stamps:
            age = min(
                number * self._period, self._age
            )  # what is measured before the start is what it was then
            seems = time - stamp
            if not (seems <= self._oldest + _ROUNDING and abs(seems - age) <= self._error + _ROUNDING):
                return True
        if not abs(stamps[0] - stamps[1]) <= _ROUNDING:
            return True
        if before is None:
            return False
        passed = (number - before[0]) * self._period
        jumped = abs(time - before[1] - passed) > _ROUNDING + _SLEWED * passed
        return jumped or any(now < then - _ROUNDING for now, then in zip(stamps, before[2], strict=True))
