"""How much of each departure axis and position bear: by a search for the worst, beside what is certified."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import ceil, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rows import Row
from benchmarks.sampled_axis import attacks, push_towards, run_axis
from benchmarks.sampled_position import worst_departures
from benchmarks.tasks import Task
from coop_drake.answers import Found
from coop_drake.answers.budget import Budget
from coop_drake.laws.axis_table import axis_table, track_row
from coop_drake.laws.sampling import whole_periods
from coop_drake.planning.budget.axis_sets import Entry, axis_sets, conditions_of
from coop_drake.planning.budget.position_tube import PositionGains, position_tubes
from coop_drake.tree.pose import FloatArray

_LARGEST = {
    "delay": 0.1, "lag": 0.1, "angle_noise": 0.1, "rate_noise": 3.0, "model_error": 0.95,
    "acceleration_error": 60.0, "position_noise": 0.1, "velocity_noise": 3.0,
}  # fmt: skip
"""Departures beyond these are not tried, in the units of ``Budget``."""

_HALVINGS = 9
_SEARCHES = 4
"""Times that disturbances are turned to push to one side, about the motion that they caused [-]."""

_SECONDS = 2.0
_TARGETS = (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
"""For how long an axis is followed [s], and the shares of this time at which it is pushed out [-]."""

_TRANSITIONS = (0, 3, 12)
"""Transitions of base whose axes are tried."""


_OF_AXES = ("delay", "lag", "angle_noise", "rate_noise", "model_error", "acceleration_error")
_OF_POSITION = ("delay", "lag", "position_noise", "velocity_noise", "model_error", "acceleration_error")

_LOOP = PositionGains(150.0, 1.4 * sqrt(150.0), 400.0, 40.0, 1.3)
_RADIUS = 0.018
"""The position's loop for base under the preset ``mobile_base``, and its tube's radius [m]."""


def breaking_tasks() -> list[Task]:
    """All axes are tried together, and so are all departures of the position."""
    return [
        Task("breaking/base", lambda rows: _rows()),
        Task("breaking/position", lambda rows: [_position_row(name) for name in _OF_POSITION]),
    ]


def _rows() -> list[Row]:
    from coop_drake.cli.task import read_task
    from coop_drake.planning.planner import plan
    from coop_drake.shipped import scenario_file

    task = read_task(scenario_file(Path("base")))
    answer = plan(task.problem, task.scenario.gain_sets["scheduled"], gain_set_name="scheduled")
    assert isinstance(answer, Found)  # base has a plan
    found = answer.plan
    rows = []
    for k in _TRANSITIONS:
        table, transition = axis_table(found.funnel(k), found.transitions[k].gains), found.transitions[k - 1]
        rest = found.start[2:] if k == 0 else 0.5 * (transition.goal_lower + transition.goal_upper)
        for axis, row in enumerate(table):
            label = f"breaking/base/transition_{k}_axis_{axis}"
            rows += [_row(f"{label}/{name}", row, float(rest[axis]), name) for name in _OF_AXES]
    return rows


def _row(label: str, row: FloatArray, rest: float, name: str) -> Row:
    def certified(budget: Budget) -> bool:
        return axis_sets(row, conditions_of(budget), Entry(rest, rest), 1).distance > 0.0

    measured = _largest(name, lambda budget: _survives(row, rest, budget))
    return Row(label, measured, "as budget", "certified", _largest(name, certified))


def _largest(name: str, holds: Callable[[Budget], bool]) -> float:
    low, high = 0.0, _LARGEST[name]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        departure: dict[str, Any] = {name: middle}
        low, high = (middle, high) if holds(Budget(**departure)) else (low, middle)
    return low


def _survives(row: FloatArray, rest: float, budget: Budget) -> bool:
    size = np.array([budget.angle_noise, budget.rate_noise, budget.acceleration_error])
    jump, period = -track_row(row, 0.0, rest, 0.0)[0], budget.period
    samples, delay = ceil(_SECONDS / period), whole_periods(budget.delay, period)
    motion = np.zeros((samples, 3))

    def kept(disturbances: FloatArray, factor: float) -> bool:
        start = (rest, 0.0, 0.0)
        return run_axis(row, period, delay, budget.lag, start, jump, disturbances, factor, 1, motion)

    for factor in (1.0 - budget.model_error, 1.0, 1.0 + budget.model_error):
        if not all(kept(disturbances, factor) for disturbances in attacks(row, period, size, samples, 0)):
            return False
        for share, side in product(_TARGETS, (-1.0, 1.0)):
            disturbances, target = np.zeros((samples, 3)), (int(share * samples), side)
            for _ in range(_SEARCHES):
                if not kept(disturbances, factor):
                    return False
                push_towards(
                    row, period, delay, budget.lag, size, factor, 1, target, motion, disturbances
                )  # fmt: skip
            if not kept(disturbances, factor):
                return False
    return True


def _position_row(name: str) -> Row:
    def certified(budget: Budget) -> bool:
        (tube,) = position_tubes([_LOOP], budget)
        return tube is not None and tube.radius <= _RADIUS

    measured = _largest(name, _tracks)
    return Row(f"breaking/position/{name}", measured, "as budget", "certified", _largest(name, certified))


def _tracks(budget: Budget) -> bool:
    """Whether the position stays within the radius under the worst disturbances and steps of p_G."""
    steps = _LOOP.speed * budget.period
    sizes = np.array([steps, budget.position_noise, budget.velocity_noise, budget.acceleration_error])
    delay = ceil(budget.delay / budget.period - 1e-6)
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that is not stable grows beyond all numbers
        worst = [
            np.abs(worst_departures(_LOOP, budget.period, delay, budget.lag, factor, sizes)).max()
            for factor in (1.0 - budget.model_error, 1.0 + budget.model_error)
        ]
    return bool(max(worst) <= _RADIUS)
