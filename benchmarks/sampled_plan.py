"""The axes of a whole plan, sampled, delayed and disturbed, from the first cell to the last."""

from __future__ import annotations

from math import exp

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Plan
from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import FADING_TIME, LEAVING_TIME, axis_table, bounds_of, rest_jump, track_row
from coop_drake.laws.hand_over import fading
from coop_drake.laws.readiness import axis_ready
from coop_drake.laws.sampling import whole_periods
from coop_drake.tree.pose import FloatArray

HELD, SLOWEST = 0.5, 6.0
"""A plan's axes are followed for so long in the last cell, and for so long in any other one at most [s]."""


def carry_axes(plan: Plan, budget: Budget, seed: int) -> float:
    """Simulate all axes of a plan with random disturbances within a budget.

    Every disturbance is drawn anew for each axis: noise of random sizes, constant, alternating at random or
    anew in every sample; the model's factor; how long the object's position lets all wait in a cell; and how
    old the reports are that a switch rests on.

    Args:
        plan: A plan with a budget.
        budget: The budget, or another one.
        seed: Of the disturbances.

    Returns:
        Least distance to a funnel's bound [rad or m], negative where an axis left its funnel or never came to
        rest.
    """
    tables = np.array([axis_table(plan.funnel(k), one.gains) for k, one in enumerate(plan.transitions)])
    generator, axes = np.random.default_rng(seed), tables.shape[1]
    samples = int((SLOWEST + plan_seconds(plan)) / budget.period)
    size = np.array([budget.angle_noise, budget.rate_noise, budget.acceleration_error])
    return float(
        _carry(
            tables,
            plan.start[2:],
            np.array([budget.period, budget.lag]),
            np.array([whole_periods(time, budget.period) for time in (budget.delay, budget.report_age)]),
            1.0 + budget.model_error * generator.choice([-1.0, 0.0, 1.0], axes),
            size * _waves(generator, samples, axes),
            generator.exponential(0.1, len(tables)) * generator.choice([0.0, 1.0], len(tables)),
        )
    )


def plan_seconds(plan: Plan) -> float:
    """Return three times the estimated duration of a plan [s]."""
    return 3.0 * sum(transition.estimated_time for transition in plan.transitions)


def _waves(generator: np.random.Generator, samples: int, axes: int) -> FloatArray:
    """Return disturbances within -1 and 1, shape (samples, axes, 3)."""
    waves = np.empty((samples, axes, 3))
    times = np.arange(samples)
    for place in np.ndindex(axes, 3):
        kind, length = generator.integers(4), generator.uniform(3.0, 120.0)
        if kind == 0:
            values = np.full(samples, generator.choice([-1.0, 1.0]))
        elif kind == 1:
            values = np.sign(np.sin(2.0 * np.pi * times / length + generator.uniform(0.0, 6.3)))
        elif kind == 2:
            values = generator.choice([-1.0, 1.0], samples)
        else:
            values = generator.uniform(-1.0, 1.0, samples)
        waves[(slice(None), *place)] = values
    return waves


@compiled
def _carry(
    tables: FloatArray,
    start: FloatArray,
    times: FloatArray,
    periods: FloatArray,
    factors: FloatArray,
    disturbances: FloatArray,
    waits: FloatArray,
) -> float:
    """Return what ``carry_axes`` does. A robot hears of a switch one period late.

    Args:
        tables: The axes in every cell, shape (cells, axes, ``LAW_COLUMNS``).
        start: Where they rest at the beginning, shape (axes,).
        times: Control period and lag of the actuators [s].
        periods: Delay of measurements and age of reports in periods.
        factors: Factor by which the model makes accelerations too large, shape (axes,).
        disturbances: Errors of position, rate and acceleration, shape (samples, axes, 3).
        waits: How much longer the axes wait in every cell, because the position does [s].
    """
    T, lag = times[0], times[1]
    delay, age = int(periods[0]), int(periods[1])
    cells, m, n = tables.shape[0], tables.shape[1], disturbances.shape[0]
    x, v, p, jumps = start.copy(), np.zeros(m), np.zeros(m), np.zeros(m)
    before = np.zeros((n + 1, m, 2))
    seen, reported = np.empty((m, 2)), np.full(m, -n)
    for i in range(m):
        jumps[i] = -track_row(tables[0, i], 0.0, start[i], 0.0)[0]
    old = jumps.copy()
    cell, entered, nearest, former = 0, 0, np.inf, 0
    for k in range(n):
        ready = True
        for i in range(m):
            before[k, i, 0], before[k, i, 1] = x[i], v[i]
            for j in range(2):
                seen[i, j] = before[max(k - delay, 0), i, j] + disturbances[k, i, j]
            following = tables[min(cell + 1, cells - 1), i]
            rests = axis_ready(tables[cell, i], following, seen[i, 0], seen[i, 1]) >= 0.0
            if rests and (k - entered) * T >= tables[cell, i, LEAVING_TIME] - 1e-9:
                reported[i] = k
            ready = ready and k - reported[i] <= age
        if cell + 1 == cells and (k - entered) * T > HELD + tables[cell, 0, LEAVING_TIME]:
            return nearest
        if ready and cell + 1 < cells and (k - entered) * T > tables[cell, 0, LEAVING_TIME] + waits[cell]:
            old[:] = jumps
            for i in range(m):
                jumps[i], reported[i] = rest_jump(tables[cell, i], tables[cell + 1, i]), -n
            former, entered, cell = entered, k, cell + 1
        elif (k - entered) * T > SLOWEST:
            return -1.0
        for i in range(m):
            row, since, jump = tables[cell, i], (k - entered) * T, jumps[i]
            if k == entered and cell > 0:
                row, since, jump = tables[cell - 1, i], (k - former) * T, old[i]
            u = track_row(row, since, seen[i, 0], seen[i, 1])[0] + fading(since, row[FADING_TIME]) * jump
            u = factors[i] * u + disturbances[k, i, 2]
            for half in range(2):
                t = 0.5 * T
                left = exp(-t / lag) if lag > 0.0 else 0.0
                gap = p[i] - u
                x[i] += t * v[i] + 0.5 * t * t * u + (lag * t - lag * lag * (1.0 - left)) * gap
                v[i] += t * u + lag * (1.0 - left) * gap
                p[i] = u + left * gap
                lower, upper = bounds_of(tables[cell, i], (k - entered + 0.5 * (1 + half)) * T)[:2]
                nearest = min(nearest, x[i] - lower, upper - x[i])
        if not nearest > 0.0:
            return nearest
    return -1.0
