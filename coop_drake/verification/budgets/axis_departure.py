"""How far axes may depart from their nominal motions under a budget, for the gains that a plan states.

The departure e of an axis obeys e'' = (1 + epsilon) q + epsilon a + w, a being the acceleration of its
nominal motion and q the pull -K e - zeta e' of a delayed, noisy, sampled and lagging loop. Where the factor
1 + epsilon is f + d, with |d| at most a part of the model's error, the loop e'' = f q is linear and known.
"""

from __future__ import annotations

from collections import deque
from math import ceil

import numpy as np

from coop_drake.answers.axis_tracking import AxisTracking
from coop_drake.answers.budget import Budget
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.position_loop import carried, mean_size

PARTS = 5
"""Parts into which the range of the model's error is cut [-]."""

HORIZON = 4.0
"""Responses are summed for so long [s]."""

LEFT = 1e-7
"""What may be left of a unit response after that [rad or m, rad/s or m/s]."""

RECENT = 0.3
"""What entered longer ago counts with its largest size in the whole plan [s]."""


def departures(
    tracking: AxisTracking, budget: Budget, accelerations: FloatArray, stays: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the largest departures of all axes, their rates and accelerations, (transitions, axes) each.

    Args:
        tracking: Gains of the pull.
        budget: The budget.
        accelerations: Largest nominal accelerations, shape (transitions, axes) [rad/s^2 or m/s^2].
        stays: For how long every cell is kept at least, shape (transitions,) [s].

    Raises:
        RefusalError: The loop does not come to rest.
    """
    parts = PARTS if budget.model_error > 0.0 else 1
    spread = budget.model_error / parts
    errors = budget.model_error * (np.arange(1, 2 * parts, 2) / parts - 1.0)
    command, push, old = _sums(tracking, budget, errors)
    if not (spread * push[2] < 1.0).all():
        raise RefusalError("axis_tracking", "the error of the model may exceed what the loop makes up for")
    noise = tracking.stiffness * budget.angle_noise + tracking.damping * budget.rate_noise
    share = (np.abs(errors) + spread)[:, None, None]
    near, largest = _recent(accelerations, stays), accelerations.max(axis=0)
    other, own = budget.acceleration_error + share * largest, budget.acceleration_error + share * near
    columns = (..., None, None)
    pull = noise * (1.0 + command[2][columns]) + push[2][columns] * other
    pull = pull / (1.0 - spread * push[2][columns])
    between = (1.0 + budget.model_error) * pull + own
    found = []
    for i, reach in enumerate((budget.period**2 / 8.0, budget.period / 2.0)):
        recent, before = (push[i] - old[i])[columns], old[i][columns]
        away = noise * command[i][columns] + recent * (own + spread * pull) + before * (other + spread * pull)
        found.append((away + reach * between).max(axis=0))
    return found[0], found[1], between.max(axis=0)


def _recent(accelerations: FloatArray, stays: FloatArray) -> FloatArray:
    """Return the largest accelerations of every transition and of those that ended within ``RECENT``."""
    begins = np.concatenate(([0.0], np.cumsum(stays)))[:-1]
    ends, last = begins + stays, accelerations.copy()
    for k, begin in enumerate(begins):
        last[k] = accelerations[: k + 1][(begin - ends[: k + 1] < RECENT)].max(axis=0)
    return last


def _sums(tracking: AxisTracking, budget: Budget, errors: FloatArray) -> tuple[FloatArray, ...]:
    """Return sums of absolute responses of e, e' and the pull, three arrays of shape (3, parts).

    They are those to a unit of command in each period, to a unit of acceleration at all times, and what the
    latter causes later than ``RECENT``.
    """
    T, delay = budget.period, ceil(budget.delay / budget.period - 1e-9)
    e, v, a = np.zeros((3, 3, len(errors)))  # runs: a command, a rate, a place
    v[1], e[2] = 1.0, 1.0
    past = deque([(0.0 * e, 0.0 * v)] * delay, maxlen=delay + 1)
    command, push, old = np.zeros((3, 3, len(errors)))
    for k in range(ceil(HORIZON / T)):
        past.append((e, v))
        pull = -tracking.stiffness * past[0][0] - tracking.damping * past[0][1]
        found = np.array([e, v, pull])
        command += np.abs(found[:, 0])
        size = T * mean_size(found[:, 1], found[:, 1] + T * found[:, 2])
        push += size
        old += size if k >= ceil(RECENT / T - 1e-9) else 0.0
        if k == 0:
            pull[0] += 1.0
        e, v, a = carried(e, v, a, pull, 1.0 + errors, budget.lag, T)
    if not max(np.abs(e).max(), np.abs(v).max()) < LEFT:
        raise RefusalError("axis_tracking", f"the axes have not come to rest after {HORIZON} s")
    return command, push, old
