"""When a sampled robot says that the goal is reached: by the pose and the joints that it measures, averaged.

A robot remembers what it measured, raw, in two times of ``MEAN_TIME``, one after the other, W samples each.
With their means m_0 and m_1, the newer ones' standard deviation s, and d^2 half the mean square of the
differences of one to the next, it has arrived where

    |m_1 - goal| <= tolerance - max(e, e_s),  |m_1 - m_0| <= r + 2 (e + e_s),  s^2 <= 2.5 d^2 + (r + e)^2.

e is the certified error of what it measures; in the first inequality a tenth of the tolerance counts where
that is more (erratum E17b). e_s = c s / root W is the error of the mean by how the samples scatter, and r
what counts as rest in ``MEAN_TIME``. In noise that is independent from sample to sample s and d are alike; s
is larger where the object moves to and fro. What all samples have in common, as a bias, does not show.
"""

from __future__ import annotations

from math import hypot, inf, isfinite, sqrt
from typing import NamedTuple

from coop_drake.jit import compiled
from coop_drake.laws.readiness import EROSION, RATE_TOLERANCE, SPEED_TOLERANCE
from coop_drake.laws.sampling import whole_periods
from coop_drake.tree.pose import FloatArray

MEAN_TIME = 0.1
"""Time over which robots average what they measure [s]: long against a control period, so that noise averages
out, and short beside a transport. What counts as rest moves by at most 1 mm and 2 mrad meanwhile."""

PLANE_DEVIATIONS = 3.44
"""c for positions in the plane [-]: a normal vector is rarely longer than so many standard deviations of a
coordinate, as rarely as a normal number is beyond ``DEVIATIONS`` of its own."""

DEVIATIONS = 3.0
"""c for angles and joints [-]: one number in 370 is beyond."""

SCATTER = 2.5
"""Largest s^2 over d^2 in noise [-]: of 20 independent numbers the share has a deviation of 0.2 about 1."""

FAR = -1.0
"""Margin of a robot that has not measured for long enough [-]."""


class ArrivalGoal(NamedTuple):
    """What a robot compares its means with.

    Attributes:
        place: Where the object shall be, then its angle and the robot's own joints, shape (3 + n,); the value
            of a free joint is not read [m, rad].
        tolerances: Largest distance of the object from its place, then the tolerances of the angle and the
            joints, infinite for free ones, shape (2 + n,) [m, rad].
        errors: Certified errors of what is measured, in this order, shape (2 + n,) [m, rad].
    """

    place: FloatArray
    tolerances: FloatArray
    errors: FloatArray


def mean_samples(period: float) -> int:
    """Return W, the number of samples of a mean, at least two."""
    return max(2, whole_periods(MEAN_TIME, period))


@compiled(borrows=True)
def arrival_margin(
    place: FloatArray, tolerances: FloatArray, errors: FloatArray, recent: FloatArray, newest: int
) -> float:
    """Return the margin with which a robot has arrived by what it measures, arrived if not negative [-].

    Args:
        place: This and the next two arguments are the fields of an ``ArrivalGoal``; see there.
        tolerances: The tolerances.
        errors: The certified errors.
        recent: (x, y, theta, own joints) as measured at the last 2 W samples, infinite where there were
            fewer, shape (2 W, 3 + n) [m, rad].
        newest: The row of the newest ones; the older ones stand before it, the last row before the first.
    """
    margin = 1.0
    x, y = _statistics(recent, newest, 0), _statistics(recent, newest, 1)
    for i in range(tolerances.size):
        if i == 0:
            away, before = hypot(x[0] - place[0], y[0] - place[1]), x[1]
            moved = hypot(x[0] - x[1], y[0] - y[1])
            scatter, steps = 0.5 * (x[2] + y[2]), 0.5 * (x[3] + y[3])
            rest, deviations = MEAN_TIME * SPEED_TOLERANCE, PLANE_DEVIATIONS
        else:
            mean, before, scatter, steps = _statistics(recent, newest, 2 + i - 1)
            away, moved = abs(mean - place[1 + i]), abs(mean - before)
            rest, deviations = MEAN_TIME * RATE_TOLERANCE, DEVIATIONS
        if not isfinite(before):
            return FAR
        noise, still = deviations * sqrt(2.0 * scatter / recent.shape[0]), rest + errors[i]
        margin = min(margin, 1.0 - moved / (rest + 2.0 * (errors[i] + noise)))
        margin = min(margin, 1.0 - scatter / (SCATTER * steps + still * still))
        if tolerances[i] < inf:
            within = tolerances[i] - max(EROSION * tolerances[i], errors[i], noise)
            margin = min(margin, 1.0 - away / within if within > 0.0 else FAR)
    return margin


@compiled(borrows=True)
def _statistics(recent: FloatArray, newest: int, column: int) -> tuple[float, float, float, float]:
    """Return m_1, m_0, s^2 and d^2 of one column."""
    rows = recent.shape[0]
    half, mean, before, scatter, steps = rows // 2, 0.0, 0.0, 0.0, 0.0
    for i in range(half):
        mean += recent[(newest - i) % rows, column] / half
        before += recent[(newest - half - i) % rows, column] / half
    for i in range(half):
        value = recent[(newest - i) % rows, column]
        scatter += (value - mean) ** 2 / (half - 1)
        if i + 1 < half:
            steps += 0.5 * (value - recent[(newest - i - 1) % rows, column]) ** 2 / (half - 1)
    return mean, before, scatter, steps
