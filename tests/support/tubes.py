"""Plans with a budget for the open room of ``small_plan``."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from coop_drake.answers import Plan
from coop_drake.answers.budget import Budget
from coop_drake.laws import ScheduledGains
from coop_drake.planning.budget.fitting import fit_budget
from coop_drake.planning.budget.position_fit import fit_position
from coop_drake.plant import planning_problem
from coop_drake.scenario import Deployment, Scenario
from tests.support.small_loop import small_problem

BUDGET = Budget(
    control_rate=200.0,
    delay=0.01,
    lag=0.005,
    position_noise=0.0024,
    velocity_noise=0.04,
    single_noise=1.4,
    model_error=0.2,
    acceleration_error=0.2,
    report_age=0.03,
    axes=False,
)
"""About that of the preset ``mobile_base``."""


WITH_AXES = replace(BUDGET, axes=True, angle_noise=0.0015, rate_noise=0.03)
"""The same with angles and joints."""


@cache
def tubed_problem(budget: Budget = BUDGET, team: str = "base") -> tuple[Scenario, Plan]:
    """Scenario with this control rate, and its plan with a tube for a budget."""
    scenario, plan = small_problem(team, ScheduledGains(command_age=0.0175))
    scenario = replace(scenario, deployment=Deployment(control_rate=budget.control_rate))
    problem, gains = planning_problem(scenario), ScheduledGains(command_age=0.0175)
    fitted = fit_budget(problem, plan, gains, budget) if budget.axes else plan
    assert isinstance(fitted, Plan), fitted
    tubed = fit_position(problem, fitted, gains, budget)
    assert isinstance(tubed, Plan), tubed
    return scenario, tubed
