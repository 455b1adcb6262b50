"""Teams that pass from cell to cell, with limits as people have them; each is planned once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from coop_drake import Found, Scenario, load_scenario, plan
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.motion import quickest_motion
from coop_drake.plant.problem import planning_problem
from coop_drake.scenario.model import RobotLimits
from tests.support.small_loop import small_problem

LIMITS = {"*": RobotLimits(1.0, 1.0, (1.0,), (2.0,))}


def passing(scenario: Scenario) -> Scenario:
    """The scenario of a team that passes from cell to cell, within limits of speeds and joints."""
    return replace(scenario, planner=replace(scenario.planner, hand_over="pass"), limits=LIMITS)


@cache
def small_motion(team: str = "base") -> tuple[Scenario, Plan]:
    """Scenario and hand-written plan of a team in the open room, with the quickest motion along it.

    The motion keeps a hundredth of a radian to the ends of the cells, so that the team may depart from it.
    """
    scenario, found = small_problem(team)
    scenario = passing(scenario)
    cells = tuple(replace(one, lower=one.lower + 0.01, upper=one.upper - 0.01) for one in found.cells)
    narrow, problem = replace(found, cells=cells), planning_problem(scenario)
    return scenario, replace(found, motion=quickest_motion(narrow, problem, 0.0175))


@cache
def planned_motion(name: str) -> tuple[Plan, PlanningProblem]:
    """The plan of a shipped scenario, with its motion, and the question that it answers."""
    scenario = passing(load_scenario(name))
    answer = plan(scenario)
    assert isinstance(answer, Found)
    assert answer.plan.motion is not None
    return answer.plan, planning_problem(scenario)
