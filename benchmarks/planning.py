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
    """Plan every case twice and count the second time; returns the base scenario and its plan, too."""
    rows, results, scenarios = [], {}, {}
    for name in CASES:
        scenarios[name] = load_scenario(f"models/{name}.scenario.yaml")
        _, first = _timed_plan(scenarios[name])
        results[name], seconds = _timed_plan(scenarios[name])
        what = f"planning {name} ({answer_of(results[name])}, {results[name].report.slices} slices)"
        rows.append(Row(what, seconds, "cpu s", "first time, kernels cold", first))
    return rows, scenarios["base"], results["base"].plan


def _timed_plan(scenario: Scenario) -> tuple[PlanningResult, float]:
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    gains = scenario.selected_gains
    start = process_time()
    result = plan(problem, scenario.gain_sets[gains], gain_set_name=gains)
    return result, process_time() - start
