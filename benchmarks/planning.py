"""How long the planner takes on the five shipped cases."""

from __future__ import annotations

from time import process_time

from pydrake.systems.framework import DiagramBuilder

from benchmarks.rows import Row
from coop_drake.cli.measures import answer_of
from coop_drake.planning import Plan, PlanningResult
from coop_drake.planning.planner import plan
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario, load_scenario

__all__ = ["CASES", "bench_planning"]

CASES = ("base", "tight", "closed", "three", "elbow")


def bench_planning() -> tuple[list[Row], Scenario, Plan]:
    """Plan every case once the kernels are warm; returns the base scenario and its plan, too."""
    rows, base = [], load_scenario("models/base.scenario.yaml")
    _timed_plan(base)
    found, base_seconds = _timed_plan(base)
    for name in CASES:
        result, seconds = _timed_plan(load_scenario(f"models/{name}.scenario.yaml"))
        what = f"planning {name} ({answer_of(result)}, {result.report.slices} slices)"
        rows.append(Row(what, seconds, "cpu s", "planning base", base_seconds))
    return rows, base, found.plan


def _timed_plan(scenario: Scenario) -> tuple[PlanningResult, float]:
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    gains = scenario.selected_gains
    start = process_time()
    result = plan(problem, scenario.gain_sets[gains], gain_set_name=gains)
    return result, process_time() - start
