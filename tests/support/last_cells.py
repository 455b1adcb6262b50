"""The end of a plan as a plan of its own, small enough to be verified many times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.duration import timed


def last_cells(plan: Plan, problem: PlanningProblem, count: int) -> tuple[Plan, PlanningProblem]:
    """The last cells of a plan, and the question that they answer: from rest where the first is entered."""
    before = plan.transitions[-count - 1]
    start = np.concatenate([before.target, 0.5 * (before.goal_lower + before.goal_upper)])
    asked = replace(problem, start=start)
    cells, transitions = plan.cells[-count:], plan.transitions[-count:]
    restart = plan.restart and replace(plan.restart, departures=plan.restart.departures[-count:])
    ended = replace(plan, start=start, cells=cells, transitions=transitions, restart=restart)
    return timed(replace(ended, problem=problem_digest(asked))), asked
