"""Processes of their own: what messages and robots cost, what killed and limp ones do, how stops end."""

from __future__ import annotations

import resource
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from time import perf_counter

import numpy as np

from benchmarks.departures import deployment_of
from benchmarks.one_process import DirectExchange, simulate_apart
from benchmarks.ring_teams import ring_transport
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, Plan, load_scenario, plan
from coop_drake.answers.log import SimulationLog
from coop_drake.apart import simulate_in_processes
from coop_drake.apart.membership import Stop
from coop_drake.diagram import control_period
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.scenario import Deployment, Scenario, with_gains
from coop_drake.simulation import Sample, build_maps, simulate

_TEAMS = (2, 4, 8)
"""Numbers of robots."""

_RATE = 200.0
"""Control rate [Hz]."""

_SIMULATED = 1.0
"""Simulated time of a run [s]: 200 samples."""

_START = 0.02
"""Simulated time of a run that is subtracted, because processes start and prepare in it [s]: four samples."""


def apart_tasks() -> list[Task]:
    """One team after the other, with the machine to itself."""
    return [_task(robots) for robots in _TEAMS]


def _task(robots: int) -> Task:
    return Task(f"apart/cost/{robots}_robots", lambda rows: costs(robots, _SIMULATED), alone=True)


def costs(robots: int, simulated: float) -> list[Row]:
    """Simulated over wall time of both, CPU time of all processes, and that of a robot without its start.

    Args:
        robots: Number of robots.
        simulated: Simulated time [s].
    """
    with ring_transport(robots) as (scenario, plan, maps):
        sampled = replace(scenario, deployment=Deployment(control_rate=_RATE))

        def brief(time: float) -> Scenario:
            return replace(sampled, simulator=replace(sampled.simulator, max_time=time))

        def in_processes(time: float) -> Sequence[float]:
            return _measured(
                lambda observer: simulate_in_processes(brief(time), plan, maps, observer=observer)
            )

        together = _measured(lambda observer: simulate(brief(simulated), plan, maps, observer=observer))
        apart, start = in_processes(simulated), in_processes(_START)
    name = f"apart/cost/{robots}_robots"
    each = (apart[2] - start[2]) / (robots * _RATE * (simulated - _START))
    return [
        Row(f"{name}/times_real_time", apart[0], "", "one process", together[0]),
        Row(f"{name}/cpu", apart[1], "s", "one process", together[1]),
        Row(f"{name}/cpu_each_robot_and_sample", 1e6 * each, "us"),
    ]


def _measured(run: Callable[[Callable[[Sample], None]], SimulationLog]) -> Sequence[float]:
    """Simulated over wall time of the loop; CPU time of all, and of others alone, with start [s]."""
    own, children = _cpu(resource.RUSAGE_SELF), _cpu(resource.RUSAGE_CHILDREN)
    seen: list[tuple[float, float]] = []
    run(lambda sample: seen.append((sample.time, perf_counter())))
    others = _cpu(resource.RUSAGE_CHILDREN) - children
    (begin, first), (end, last) = seen[0], seen[-1]
    return (end - begin) / (last - first), _cpu(resource.RUSAGE_SELF) - own + others, others


def _cpu(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


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
    resting = with_gains(ideal, "scheduled")
    scenario = replace(resting, deployment=deployment_of({"preset": "mobile_base"}))
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
        "goes_on_after": (max((stop.resumed or inf) - stop.since for stop in found), "s"),
        "clearance": (1e3 * nearest, "mm"),
    }
    return [Row(f"{name}/{figure}", float(value), unit) for figure, (value, unit) in figures.items()]
