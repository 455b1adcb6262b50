"""The axes of a whole plan, sampled, delayed and disturbed, from the first cell to the last."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Plan
from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    FADING_TIME,
    LEAVING_TIME,
    axis_table,
    bounds_of,
    switch_jump,
    track_row,
)
from coop_drake.laws.governor import governed_acceleration
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.nominal import carry_axes as carry_nominal
from coop_drake.laws.nominal import lag_factors
from coop_drake.laws.ppc import fading
from coop_drake.laws.readiness import axis_ready
from coop_drake.robustness.alarms import unseen_of
from coop_drake.tree.arrays import FloatArray

HELD, SLOWEST = 0.5, 6.0
"""A plan's axes are followed for so long in the last cell, and for so long in any other one at most [s]."""


class Departures(NamedTuple):
    """What departs from the ideal team in one run of all axes of a plan.

    Attributes:
        factors: Factor by which the model makes accelerations too large, shape (axes,).
        disturbances: Errors of position, rate and acceleration, shape (samples, axes, 3); then may follow the
            departures of position and rate to which something else takes an axis, not a number where nothing
            does, shape (samples, axes, 5).
        waits: How much longer the axes wait in every cell, because the position does, shape (cells,) [s].
    """

    factors: FloatArray
    disturbances: FloatArray
    waits: FloatArray


class AxesRun(NamedTuple):
    """One run of all axes of a plan.

    Attributes:
        nearest: Least distance to a funnel's bound [rad or m], negative where an axis left its funnel or its
            nominal motion never came to rest.
        farthest: Largest departures from the nominal motions in every cell, then of where their rates take
            them until a report is used that knows of it, shape (2, cells, axes) [rad or m].
        rooms: Distances to the lower, then to the upper bound at every sample, shape (samples, 2, axes) [rad
            or m].
        places: The cell, and the number of samples since its entry, at every sample, shape (samples, 2).
    """

    nearest: float
    farthest: FloatArray
    rooms: FloatArray
    places: FloatArray


def random_departures(plan: Plan, budget: Budget, seed: int) -> Departures:
    """Return departures within a budget, all drawn anew for each axis.

    Noise is of random sizes, constant, alternating at random or anew in every sample.
    """
    generator, cells, axes = np.random.default_rng(seed), len(plan.cells), len(plan.start) - 2
    size = np.array([budget.angle_noise, budget.rate_noise, budget.acceleration_error])
    return Departures(
        1.0 + budget.model_error * generator.choice([-1.0, 0.0, 1.0], axes),
        size * _waves(generator, _samples(plan, budget), axes),
        generator.exponential(0.1, cells) * generator.choice([0.0, 1.0], cells),
    )


def worst_departures(plan: Plan, budget: Budget, seed: int) -> Departures:
    """Return departures within a budget that take every axis as near to a bound of its funnel as they can.

    The loop is linear and no departure changes the nominal motion, so that both can be computed before. All
    errors have the signs of the loop's responses, back from the sample and towards the bound for which the
    distance of the nominal motion, less what all errors together and the model's error can take from it, is
    least. The waits in the cells are drawn at random.
    """
    none = random_departures(plan, budget.scaled(0.0), seed)
    assert plan.axis_tracking is not None  # the plan has a budget for the axes
    gains, delay = plan.axis_tracking, whole_periods(budget.delay, budget.period)
    axes, samples = none.disturbances.shape[1], len(none.disturbances)
    size = np.array([-budget.angle_noise, -budget.rate_noise, budget.acceleration_error])
    factors, errors, least = np.ones(axes), np.zeros((samples, axes, 3)), np.full(axes, np.inf)
    for factor in (1.0 - budget.model_error, 1.0 + budget.model_error):
        run = run_axes(plan, budget, none._replace(factors=np.full(axes, factor)))
        loop = budget.period, budget.lag, factor
        answer = pull_response((gains.stiffness, gains.damping), loop, delay, len(run.rooms))
        noise = factor * np.array([gains.stiffness, gains.damping]) @ np.abs(size[:2]) + abs(size[2])
        together = noise * np.concatenate(([0.0], np.cumsum(np.abs(answer[1:]))))[: len(run.rooms)]
        left = run.rooms - together[:, None, None]
        for axis in range(axes):
            last, side = np.unravel_index(np.argmin(left[:, :, axis]), left.shape[:2])
            if left[last, side, axis] < least[axis]:
                least[axis], factors[axis], errors[:, axis] = left[last, side, axis], factor, 0.0
                towards = (1.0 if side else -1.0) * np.sign(answer[1 : last + 1][::-1])
                errors[:last, axis] = towards[:, None] * size
    return Departures(factors, errors, none.waits)


def run_axes(plan: Plan, budget: Budget, departures: Departures) -> AxesRun:
    """Simulate all axes of a plan that has a budget for them, with departures within this or another one."""
    tables = np.array([axis_table(plan.funnel(k), one.gains) for k, one in enumerate(plan.transitions)])
    assert plan.axis_tracking is not None  # there is a budget for the axes
    assert plan.budget is not None
    axes, samples = tables.shape[1], len(departures.disturbances)
    farthest, rooms = np.zeros((2, len(tables), axes)), np.zeros((samples, 2, axes))
    places = np.zeros((samples, 2))
    nearest, ended = _carry(
        tables,
        plan.start[2:],
        (plan.axis_tracking.stiffness, plan.axis_tracking.damping),
        np.array([budget.period, budget.lag, plan.budget.lag, unseen_of(plan.budget)]),
        np.array([whole_periods(time, budget.period) for time in (budget.delay, budget.report_age)]),
        *departures,
        farthest,
        rooms,
        places,
    )
    return AxesRun(nearest, farthest, rooms[:ended], places[:ended])


def _samples(plan: Plan, budget: Budget) -> int:
    """Return for how many samples departures are made, enough for three times the estimated duration."""
    seconds = SLOWEST + 3.0 * sum(transition.estimated_time for transition in plan.transitions)
    return int(seconds / budget.period)


@compiled
def pull_response(
    gains: tuple[float, float], loop: tuple[float, float, float], delay: int, samples: int
) -> FloatArray:
    """Return the departures at every sample that follow a unit of command in the first period, (samples,).

    Args:
        gains: K_a [1/s^2] and zeta_a [1/s].
        loop: Control period, lag of the actuators [s], and the model's factor.
        delay: Age of measurements in periods.
        samples: How many.
    """
    T, (left, in_v, in_x) = loop[0], lag_factors(loop[0], loop[1])
    x, v, p = np.zeros(samples), np.zeros(samples), 0.0
    for k in range(samples - 1):
        u = 1.0 if k == 0 else 0.0
        if k >= delay:
            u += loop[2] * governed_acceleration(x[k - delay], v[k - delay], 0.0, gains[0], gains[1])
        gap = p - u
        x[k + 1] = x[k] + T * v[k] + 0.5 * T * T * u + in_x * gap
        v[k + 1] = v[k] + T * u + in_v * gap
        p = u + left * gap
    return x


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
    gains: tuple[float, float],
    times: FloatArray,
    periods: FloatArray,
    factors: FloatArray,
    disturbances: FloatArray,
    waits: FloatArray,
    farthest: FloatArray,
    rooms: FloatArray,
    places: FloatArray,
) -> tuple[float, int]:
    """Return the least distance to a funnel's bound, and for how many samples the axes were followed.

    A robot hears of a switch one period late.

    Args:
        tables: The axes in every cell, shape (cells, axes, ``LAW_COLUMNS``).
        start: Where they rest at the beginning, shape (axes,).
        gains: K_a and zeta_a of the pull to the nominal motion.
        times: Control period, lag of the actuators, the lag that the nominal motion has, and t [s].
        periods: Delay of measurements and age of reports in periods.
        factors: The departures, see ``Departures``.
        disturbances: The errors.
        waits: How much longer the axes wait.
        farthest: Receives the largest departures from the nominal motions.
        rooms: Receives what ``AxesRun`` says, and so does the next one.
        places: See there.
    """
    T, lag = times[0], times[1]
    delay, age = int(periods[0]), int(periods[1])
    cells, m, n = tables.shape[0], tables.shape[1], disturbances.shape[0]
    x, v, p, law, jumps = start.copy(), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    before, nominal = np.zeros((n + 1, m, 2)), np.zeros((n + 1, 3, m))
    nominal[0, 0], reported = start, np.full(m, -n)
    for i in range(m):
        jumps[i] = -track_row(tables[0, i], 0.0, start[i], 0.0)[0]
    old = jumps.copy()
    cell, entered, nearest, former = 0, 0, np.inf, 0
    for k in range(n):
        ready, places[k, 0], places[k, 1] = True, cell, k - entered
        for i in range(m):
            if disturbances.shape[2] > 3 and not np.isnan(disturbances[k, i, 3]):
                x[i] = nominal[k, 0, i] + disturbances[k, i, 3]
                v[i] = nominal[k, 1, i] + disturbances[k, i, 4]
            before[k, i, 0], before[k, i, 1] = x[i], v[i]
            e, e_rate = x[i] - nominal[k, 0, i], v[i] - nominal[k, 1, i]
            farthest[0, cell, i] = max(farthest[0, cell, i], abs(e))
            farthest[1, cell, i] = max(farthest[1, cell, i], abs(e + times[3] * e_rate))
            lower, upper = bounds_of(tables[cell, i], (k - entered) * T)[:2]
            rooms[k, 0, i], rooms[k, 1, i] = x[i] - lower, upper - x[i]
            following = tables[min(cell + 1, cells - 1), i]
            rests = min(axis_ready(tables[cell, i], following, nominal[k, 0, i], nominal[k, 1, i])) >= 0.0
            if rests and (k - entered) * T >= tables[cell, i, LEAVING_TIME] - 1e-9:
                reported[i] = k
            ready = ready and k - reported[i] <= age
        if cell + 1 == cells and (k - entered) * T > HELD + tables[cell, 0, LEAVING_TIME]:
            return nearest, k + 1
        if ready and cell + 1 < cells and (k - entered) * T > tables[cell, 0, LEAVING_TIME] + waits[cell]:
            old[:] = jumps
            for i in range(m):
                jumps[i] = switch_jump(tables[cell, i], tables[cell + 1, i], 0.0, 0.0, 0.0)
                reported[i] = -n
            former, entered, cell = entered, k, cell + 1
        elif (k - entered) * T > SLOWEST:
            return -1.0, k + 1
        for i in range(m):
            row, since, jump = tables[cell, i], (k - entered) * T, jumps[i]
            if k == entered and cell > 0:
                row, since, jump = tables[cell - 1, i], (k - former) * T, old[i]
            law[i] = track_row(row, since, nominal[k, 0, i], nominal[k, 1, i])[0]
            law[i] += fading(since, row[FADING_TIME]) * jump
            ago = max(k - delay, 0)
            seen = before[ago, i] + disturbances[k, i, :2]
            expected = nominal[ago, 0, i], nominal[ago, 1, i]
            away, fast = seen[0] - expected[0], seen[1] - expected[1]
            pulled = law[i] + governed_acceleration(away, fast, 0.0, gains[0], gains[1])
            u = factors[i] * pulled + disturbances[k, i, 2]
            for half in range(2):
                t = 0.5 * T
                left, in_v, in_x = lag_factors(t, lag)
                gap = p[i] - u
                x[i] += t * v[i] + 0.5 * t * t * u + in_x * gap
                v[i] += t * u + in_v * gap
                p[i] = u + left * gap
                lower, upper = bounds_of(tables[cell, i], (k - entered + 0.5 * (1 + half)) * T)[:2]
                nearest = min(nearest, x[i] - lower, upper - x[i])
        carry_nominal(nominal[k], law, T, times[2], nominal[k + 1])
        if not nearest > 0.0:
            return nearest, k + 1
    return -1.0, k + 1
