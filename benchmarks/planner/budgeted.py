"""What budgets cost the planner: plans with each budget beside plans without one, in one process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydrake.systems.framework import DiagramBuilder

from benchmarks.departures import deployment_of
from benchmarks.isolated import in_own_process
from benchmarks.planner.cases import Case
from benchmarks.planner.ours import Planned, plan_repeatedly
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.answers.budget import Budget
from coop_drake.laws import ScheduledGains
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.plant.facts import budget_of

CASES = ("base", "tight", "three", "elbow", "warehouse")
"""Shipped scenarios that have a plan."""

BUDGETS = {"without": None, "position": "position", "all": "all", "refused": "all"}
"""What ``plan --budget`` says in each row; in the last one the budget is ``TOO_MUCH`` times as large."""

TOO_MUCH = 2.0
"""So many times the preset's departures no shipped scenario bears [-]: the goal's tolerance is too small."""

REPEATS = 3
"""Plans of every budget; the shortest planning time counts, for the machine is never idle."""

PATIENCE = 10.0
"""A plan that took longer is not repeated [CPU s]."""


def budget_tasks(limit: float) -> list[Task]:
    """One task for every case.

    Args:
        limit: CPU time of all plans of a case together [s].
    """
    return [_task(name, limit) for name in CASES]


def _task(name: str, limit: float) -> Task:
    def measure(rows: Sequence[Row]) -> Sequence[Row]:
        return _rows(f"planner/budgets/{name}", Case(name), limit)

    return Task(f"planner/budgets/{name}", measure)


def _rows(name: str, case: Case, limit: float) -> list[Row]:
    """Return answers, transport times and CPU times, beside those without a budget."""
    done = in_own_process(plan_with_budgets, case, limit=limit).value
    if done is None:
        return [Row(f"{name}/without/answer", 0.0, f"none within {limit:g} CPU s")]
    rows, peer = [], "without"
    for label, planned in done.items():
        what = f"{name}/{label}"
        rows += [
            Row(f"{what}/answer", float(planned.answer == "found"), planned.answer),
            Row(f"{what}/cpu_seconds", planned.cpu_seconds, "s", peer, done[peer].cpu_seconds),
        ]
        if planned.answer == "found":
            seconds = planned.transport_seconds
            rows.append(Row(f"{what}/transport", seconds, "s", peer, done[peer].transport_seconds))
    return rows


def plan_with_budgets(case: Case) -> dict[str, Planned]:
    """Plan with every budget of the preset ``mobile_base``, once all have loaded the kernels.

    Args:
        case: The scenario.
    """
    deployment = deployment_of({"preset": "mobile_base"})
    scenario = replace(case.scenario(), deployment=deployment)
    unlimited = replace(deployment.actuators, base_force=None)  # what ``position`` takes
    free = replace(scenario, deployment=replace(deployment, actuators=unlimited))
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    budgets: dict[str, Budget | None] = {
        label: budget_of(choice, free if choice == "position" else scenario, problem) if choice else None
        for label, choice in BUDGETS.items()
    }
    most = budgets["refused"]
    assert most is not None
    budgets["refused"] = most.scaled(TOO_MUCH)
    gain_set = scenario.gain_sets["scheduled"]
    assert isinstance(gain_set, ScheduledGains)
    for budget in budgets.values():
        plan_repeatedly(problem, 1, PATIENCE, budget, gain_set)
    return {
        label: min(
            plan_repeatedly(problem, REPEATS, PATIENCE, budget, gain_set), key=lambda done: done.cpu_seconds
        )
        for label, budget in budgets.items()
    }
