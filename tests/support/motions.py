"""Teams that pass from cell to cell, with limits as people have them; each is planned once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from coop_drake import Found, Scenario, load_scenario, plan
from coop_drake.answers.motion import pull_gains
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws import GainSet
from coop_drake.planning.motion import quickest_motion
from coop_drake.planning.motion_limits import motion_limits
from coop_drake.plant.facts import budget_of
from coop_drake.plant.problem import planning_problem
from coop_drake.robustness.couplings import cell_couplings
from coop_drake.robustness.tracking import departures_of, moving_of
from coop_drake.scenario.deployment import Deployment, with_preset
from coop_drake.scenario.model import RobotLimits
from coop_drake.typed_data import convert
from tests.support.small_loop import small_problem

LIMITS = {"*": RobotLimits(1.0, 1.0, (1.0,), (2.0,))}

WIDER = {"*": RobotLimits(1.1, 1.1, (1.1,), (2.2,))}
"""Limits that leave room to a team that departs from a motion within those above."""


def passing(scenario: Scenario) -> Scenario:
    """The scenario of a team that passes from cell to cell, within limits of speeds and joints."""
    return replace(scenario, gains=replace(scenario.gains, selected=None), limits=LIMITS)


@cache
def small_motion(team: str = "base") -> tuple[Scenario, Plan]:
    """Scenario and hand-written plan of a team in the open room, with the quickest motion along it.

    The motion keeps a hundredth of a radian to the ends of the cells, so that the team may depart from it.
    """
    scenario, found = small_problem(team)
    scenario = passing(scenario)
    cells = tuple(replace(one, lower=one.lower + 0.01, upper=one.upper - 0.01) for one in found.cells)
    narrow, problem = replace(found, cells=cells), planning_problem(scenario)
    limits = motion_limits(problem.limits)
    return scenario, replace(found, motion=quickest_motion(narrow, problem, limits, pull_gains(0.0175)))


@cache
def planned_motion(name: str) -> tuple[Plan, PlanningProblem]:
    """The plan of a shipped scenario, with its motion, and the question that it answers."""
    scenario = passing(load_scenario(name))
    answer = plan(scenario)
    assert isinstance(answer, Found)
    assert answer.plan.motion is not None
    return answer.plan, planning_problem(scenario)


@cache
def required_budget(name: str) -> Scenario:
    """A shipped scenario that asks for a plan under the budget of a usual team."""
    actuators = {"base_torque": 500.0, "joint_effort": 300.0}
    section = with_preset({"preset": "mobile_base", "budget": "all", "actuators": actuators})
    return replace(passing(load_scenario(name)), deployment=convert(section, Deployment))


@cache
def planned_under_budget(name: str) -> tuple[Plan, PlanningProblem, GainSet]:
    """Such a plan, its question and its gain set."""
    scenario = required_budget(name)
    answer = plan(scenario)
    assert isinstance(answer, Found)
    return answer.plan, planning_problem(scenario), scenario.gain_sets[scenario.selected_gains]


@cache
def motion_under_budget() -> tuple[Scenario, Plan]:
    """Scenario and hand-written plan of a usual team, with the departures of its motion; cells are large."""
    return budgeted_motion({"preset": "mobile_base", "budget": "all"})


def budgeted_motion(deployment: dict[str, object]) -> tuple[Scenario, Plan]:
    """The same for another section ``deployment``."""
    scenario, found = small_motion()
    scenario = replace(scenario, limits=WIDER)
    section = with_preset(deployment)
    scenario = replace(scenario, deployment=convert(section, Deployment))
    problem = planning_problem(scenario)
    budget = budget_of("all", scenario, problem)
    assert budget is not None
    assert found.motion is not None
    gains = (160.0, 25.0), (200.0, 28.0)
    couplings = cell_couplings(budget, problem.tree, found.cells)
    away = departures_of(gains, budget, moving_of(found.motion), couplings)
    motion = replace(found.motion, gains=gains)
    return scenario, replace(found, budget=budget, motion=motion, departures=away)
