"""The base transport that maps and simulation are measured on, made once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import Found, Plan
from coop_drake.errors import PlanError
from coop_drake.fields import HarmonicMap
from coop_drake.planning.planner import plan
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario, load_scenario
from coop_drake.simulation import build_maps

__all__ = ["base_plan", "base_transport"]

_BASE = Path(__file__).resolve().parents[1] / "models" / "base.scenario.yaml"


@cache
def base_plan() -> tuple[Scenario, Plan]:
    """Read and plan the base case."""
    scenario = load_scenario(str(_BASE))
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    gains = scenario.selected_gains
    result = plan(problem, scenario.gain_sets[gains], gain_set_name=gains)
    if not isinstance(result, Found):
        raise PlanError(f"{_BASE}: no plan to measure maps and simulation on: {result.reason}")
    return scenario, result.plan


@cache
def base_transport() -> tuple[Scenario, Plan, tuple[HarmonicMap, ...]]:
    """Read, plan and map the base case."""
    scenario, found = base_plan()
    return scenario, found, build_maps(found)
