"""Random moments at which all drives of a shipped team brake under its budget, and how the team goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import inf

import numpy as np

from benchmarks.departures import deployment_of
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, Plan, load_scenario, plan
from coop_drake.diagram import control_period
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.nodes import DirectExchange, simulate_apart
from coop_drake.nodes.membership import Stop
from coop_drake.scenario import Scenario
from coop_drake.simulation import build_maps

__all__ = ["random_gaps", "stopped", "stops_tasks"]

TEAMS = ("base", "three", "tight", "elbow")
"""Shipped scenarios."""

RUNS = 25
"""Runs of every team [-]."""

GAP = 0.5
"""How long nobody gets a sample [s]."""

TWICE = 2.5
"""Longest time between two gaps of the same run [s]: the team brakes, rests or goes slowly then."""


def stops_tasks() -> list[Task]:
    """One team after the other."""
    return [Task(f"apart/stops/{team}", partial(_rows, team)) for team in TEAMS]


def _rows(team: str, _: Sequence[Row]) -> list[Row]:
    ideal = load_scenario(team)
    scenario = replace(ideal, deployment=deployment_of({"preset": "mobile_base", "budget": "all"}))
    answer = plan(scenario)
    if not isinstance(answer, Found):
        raise PlanError(f"{scenario.path}: no plan to stop: {answer.reason}")
    return stopped(f"apart/stops/{team}", scenario, answer.plan, build_maps(answer.plan), RUNS)


def random_gaps(end: float, period: float, seed: int) -> list[tuple[int, int]]:
    """Return one or two gaps, as ``DirectExchange`` takes them.

    Args:
        end: The first one begins before this time [s].
        period: Control period [s].
        seed: Of what is drawn.
    """
    generator = np.random.default_rng(seed)
    begins = [generator.uniform(0.0, end)]
    if seed % 3:
        begins.append(begins[0] + GAP + generator.uniform(0.0, TWICE))
    return [(round(begin / period), round((begin + GAP) / period)) for begin in begins]


def stopped(name: str, scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], runs: int) -> list[Row]:
    """Count how runs with random stops end.

    Args:
        name: What the rows are called.
        scenario: The scenario.
        plan: Its plan.
        maps: The harmonic map of every transition.
        runs: Number of runs.
    """
    end = sum(transition.estimated_time for transition in plan.transitions)
    found, arrived, nearest = list[Stop](), 0, inf
    for seed in range(runs):
        exchange = DirectExchange(random_gaps(end, control_period(scenario), seed))
        log = simulate_apart(scenario, plan, maps, exchange=exchange)
        arrived += log.reached and not log.violation
        found += exchange.membership.stops
        nearest = min(nearest, float(log.workspace_clearance.min()), float(log.body_clearance.min()))
    figures = {
        "runs": (runs, ""),
        "arrived": (arrived, ""),
        "stops": (len(found), ""),
        "certified": (sum(stop.certified for stop in found), ""),
        "goes_on_after": (max((stop.resumed or inf) - stop.since for stop in found), "s"),
        "clearance": (1e3 * nearest, "mm"),
    }
    return [Row(f"{name}/{figure}", float(value), unit) for figure, (value, unit) in figures.items()]
