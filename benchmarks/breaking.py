"""How much of each departure axes and position bear: by a search for the worst, beside what is certified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import ceil, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rows import Row
from benchmarks.sampled_plan import run_axes, worst_departures
from benchmarks.sampled_position import worst_departures as worst_of_position
from benchmarks.tasks import Task
from coop_drake.answers import Found
from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Plan
from coop_drake.laws.axis_table import axis_table
from coop_drake.planning.budget.axis_proofs import UnprovedTransition, follow_transitions
from coop_drake.robustness.axis_departure import axis_loop
from coop_drake.robustness.position import PositionGains, position_tubes

_LARGEST = {
    "delay": 0.1, "lag": 0.1, "angle_noise": 0.1, "rate_noise": 3.0, "model_error": 0.95,
    "acceleration_error": 60.0, "position_noise": 0.1, "velocity_noise": 3.0, "all": 8.0,
}  # fmt: skip
"""Departures beyond these are not tried, in the units of ``Budget``; for all together, as a multiple."""

_HALVINGS = 10

_RUNS = 3
"""Searches for the worst departures, with other waits in the cells [-]."""

MOBILE_BASE = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=0.0015, rate_noise=0.03, model_error=0.2,
    acceleration_error=0.2, report_age=0.025,
)  # fmt: skip
"""The numbers of the preset ``mobile_base``, three standard deviations of its noise being bounds."""

_SIZES = ("angle_noise", "rate_noise", "model_error", "acceleration_error")
"""Departures that act alone, with the budget's delay and lag; all of them together are scaled, too."""

_OF_AXES = ("delay", "lag", *_SIZES, "all")
"""Departures of the axes; a longer delay or lag comes with the sizes of the budget."""

_OF_POSITION = ("delay", "lag", "position_noise", "velocity_noise", "model_error", "acceleration_error")

_LOOP = PositionGains(150.0, 1.4 * sqrt(150.0), 400.0, 40.0, 1.3)
_RADIUS = 0.018
"""The position's loop for base under the preset ``mobile_base``, and its tube's radius [m]."""


def breaking_tasks() -> list[Task]:
    """All departures of the axes of base are tried together, and so are those of the position."""
    return [
        Task("breaking/base", lambda rows: _rows()),
        Task("breaking/position", lambda rows: [_position_row(name) for name in _OF_POSITION]),
    ]


def _rows() -> list[Row]:
    plan = planned_base()
    return [_axes_row(plan, name) for name in _OF_AXES]


def _axes_row(plan: Plan, name: str) -> Row:
    measured = _largest(name, lambda size: survives(plan, departing(name, size)))
    proved = _largest(name, lambda size: certified(plan, departing(name, size)))
    return Row(f"breaking/base/{name}", measured, "as budget", "certified", proved)


def planned_base() -> Plan:
    """Plan base with ``MOBILE_BASE`` for the axes and the position."""
    from coop_drake.cli.task import read_task
    from coop_drake.planning.planner import plan
    from coop_drake.shipped import scenario_file

    task = read_task(scenario_file(Path("base")))
    gain_set = task.scenario.gain_sets["scheduled"]
    answer = plan(task.problem, gain_set, gain_set_name="scheduled", budget=MOBILE_BASE)
    assert isinstance(answer, Found)  # base has a plan
    return answer.plan


def departing(name: str, size: float) -> Budget:
    """Return ``MOBILE_BASE`` with one departure of another size, see ``_SIZES``."""
    sizes: dict[str, Any] = {name: size}
    if name == "all":
        sizes = {other: size * getattr(MOBILE_BASE, other) for other in _SIZES}
    elif name in _SIZES:
        sizes = {**dict.fromkeys(_SIZES, 0.0), name: size}
    return replace(MOBILE_BASE, **sizes)


def _alone(name: str, size: float) -> Budget:
    """Return a budget of one departure alone."""
    sizes: dict[str, Any] = {name: size}
    return Budget(**sizes)


def certified(plan: Plan, budget: Budget) -> bool:
    """Whether it is proved that all axes of a plan stay in their funnels with its gains under a budget."""
    assert plan.axis_tracking is not None  # the plan has a budget for the axes
    loop = None if budget.model_error >= 1.0 else axis_loop(plan.axis_tracking, budget)
    tables = [axis_table(plan.funnel(k), one.gains) for k, one in enumerate(plan.transitions)]
    axes = len(plan.start) - 2
    nothing = np.zeros((len(tables), axes, axes, axes))
    proved = loop is not None and follow_transitions(lambda _, k: tables[k], 1, nothing, plan.start[2:], loop)
    return bool(proved) and not isinstance(proved, UnprovedTransition)


def survives(plan: Plan, budget: Budget) -> bool:
    """Whether all axes of a plan stay in their funnels under the worst departures of a budget."""
    plan = replace(plan, budget=budget)  # the nominal motion has the lag of the plan's budget
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that is not stable grows beyond all numbers
        runs = (run_axes(plan, budget, worst_departures(plan, budget, seed)) for seed in range(_RUNS))
        return all(run.nearest > 0.0 for run in runs)


def _largest(name: str, holds: Callable[[float], bool]) -> float:
    low, high = 0.0, _LARGEST[name]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _position_row(name: str) -> Row:
    def proved(size: float) -> bool:
        (tube,) = position_tubes([_LOOP], _alone(name, size))
        return tube is not None and tube.radius <= _RADIUS

    measured = _largest(name, lambda size: _tracks(_alone(name, size)))
    return Row(f"breaking/position/{name}", measured, "as budget", "certified", _largest(name, proved))


def _tracks(budget: Budget) -> bool:
    """Whether the position stays within the radius under the worst disturbances and steps of p_G."""
    steps = _LOOP.speed * budget.period
    sizes = np.array([steps, budget.position_noise, budget.velocity_noise, budget.acceleration_error])
    delay = ceil(budget.delay / budget.period - 1e-6)
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that is not stable grows beyond all numbers
        worst = [
            np.abs(worst_of_position(_LOOP, budget.period, delay, budget.lag, factor, sizes)).max()
            for factor in (1.0 - budget.model_error, 1.0 + budget.model_error)
        ]
    return bool(max(worst) <= _RADIUS)
