"""The states in which axes can enter the next cell."""

from __future__ import annotations

from math import ceil

import numpy as np

from coop_drake.answers.budget import Tolerance
from coop_drake.answers.plan import Plan
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.tubes import LATE

EROSION = 0.1
"""Fraction of a goal interval at each end in which an axis does not count as arrived [-]."""


def entering(
    plan: Plan,
    k: int,
    made: FloatArray,
    samples: FloatArray,
    members: FloatArray,
    kept: FloatArray,
    stated: Tolerance,
) -> FloatArray:
    """Return lower and upper position and rate, acceleration and history, shape (6, axes).

    Args:
        plan: The plan.
        k: The transition that ends.
        made: The tubes of all parts of its axes.
        samples: How many samples of each tube there are.
        members: Axis of each tube.
        kept: Where the axes stay afterwards.
        stated: What the transition states.
    """
    budget = plan.budget
    assert budget is not None  # only plans with a budget come here
    transition, following, cell = plan.transitions[k], plan.transitions[k + 1], plan.cells[k + 1]
    erosion = EROSION * (transition.goal_upper - transition.goal_lower)
    energy, kappa = following.gains.energy_bound, following.gains.log_gain
    share = 1.0 / (1.0 + np.exp(np.minimum(np.sqrt(2.0 * energy / kappa), 700.0)))
    width, noise = cell.upper - cell.lower, budget.angle_noise
    low = np.maximum(transition.goal_lower + erosion, cell.lower + share * width) - noise
    high = np.minimum(transition.goal_upper - erosion, cell.upper - share * width) + noise
    fast = np.sqrt(2.0 * energy) + budget.rate_noise
    middle = 0.5 * (transition.goal_lower + transition.goal_upper)
    T = budget.period
    since = ceil(budget.delay / T - 1e-6) + ceil(budget.report_age / T - 1e-6) + 1
    stay = ceil(transition.gains.hand_over_time / T - 1e-6)
    result = np.empty((6, middle.size))
    for axis in range(middle.size):
        own, states, fresh, last = np.flatnonzero(members == axis), [], 0.0, 0.0
        for i in own:
            tube = made[: samples[i], :, i]
            limits = float(low[axis]), float(high[axis]), float(fast[axis])
            states.append(_switched(tube, limits, since, T, stay))
            fresh, last = max(fresh, tube[LATE:, 4].max()), max(last, float(tube[-1, 4]))
        x, v = kept[2, own].max(), kept[3, own].max()
        states.append((middle[axis] - x, middle[axis] + x, -v, v, last))
        lows, highs, slow, quick, pushed = np.array(states).T
        result[:5, axis] = (
            max(lows.min(), cell.lower[axis]), min(highs.max(), cell.upper[axis]), slow.min(), quick.max(),
            pushed.max(),
        )  # fmt: skip
        result[5, axis] = max(fresh, stated.entry_acceleration[axis])
    return result


def _switched(
    tube: FloatArray, limits: tuple[float, float, float], since: int, period: float, stay: int
) -> tuple[float, float, float, float, float]:
    low, high, fast = limits
    x_low, x_high, v_low, v_high = (
        tube[:, 0] - tube[:, 1], tube[:, 0] + tube[:, 1], tube[:, 2] - tube[:, 3], tube[:, 2] + tube[:, 3]
    )  # fmt: skip
    reported = (x_low <= high) & (x_high >= low) & (v_low <= fast) & (v_high >= -fast)
    reported[0] = True
    times = np.flatnonzero(reported)
    after = np.arange(len(tube))[:, None] - times[None, :]
    recent = (after >= 0) & (after <= since)
    possible = recent.any(axis=1) & (np.arange(len(tube)) >= stay)
    pushed = float(tube[possible, 4].max())
    time = since * period
    farther, faster = time * (fast + 0.5 * time * pushed), fast + time * pushed
    return (
        max(float(x_low[possible].min()), low - farther),
        min(float(x_high[possible].max()), high + farther),
        max(float(v_low[possible].min()), -faster),
        min(float(v_high[possible].max()), faster),
        pushed,
    )
