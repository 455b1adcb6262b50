"""The base transport of a team that rests, by maps, that these and simulation are measured on, made once."""

from __future__ import annotations

from functools import cache

from coop_drake import Found, HarmonicMap, Plan, Scenario, build_maps, load_scenario, plan
from coop_drake.errors import PlanError
from coop_drake.scenario import with_gains


@cache
def base_plan() -> tuple[Scenario, Plan]:
    """Read and plan the base case."""
    scenario = with_gains(load_scenario("base"), "scheduled")
    result = plan(scenario)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan to measure maps and simulation on: {result.reason}")
    return scenario, result.plan


@cache
def base_transport() -> tuple[Scenario, Plan, tuple[HarmonicMap, ...]]:
    """Read, plan and map the base case."""
    scenario, found = base_plan()
    return scenario, found, build_maps(found)
