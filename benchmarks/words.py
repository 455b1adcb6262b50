"""Teams that pass from cell to cell and lose words: how far robots part, and what such runs cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from benchmarks.departures import deployment_of
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, Scenario, build_maps, load_scenario, plan
from coop_drake.compiled_loop import CompiledTransport, prepare, run
from coop_drake.compiling import COMPILING
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.scenario import Deafness, RobotDepartures, Silence, with_gains
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import simulate

TEAMS = ("base", "three")

RUNS = 100
"""Runs of each fault, by seeds from 0 on, each at a random moment of the transport."""

DURATION = 0.5
"""How long a robot is deaf or mute [s]."""

LATE = 0.01
"""How long words travel [s]: of those that are lost, a repeat comes within 50 ms with all but 1e-6."""

CLOCKS = 0.002
"""Error of every clock, of random sign [s]."""

_DEPLOYMENT: dict[str, Any] = {"preset": "mobile_base", "messages": {"delay": LATE}}
"""Departures of all runs: noise, delays, lag, wrong masses, and a fifth of the words lost."""

_LIMITS = {"*": RobotLimits(1.0, 1.0, (1.0,), (2.0,))}
"""Bases at 1 m/s and 1 rad/s, joints at 1 rad/s and 2 rad/s^2."""


def word_tasks() -> list[Task]:
    """Each team with a robot that is deaf or mute, and the cost of its runs."""
    faults = [
        Task(f"words/{team}/{fault}", partial(_parted, team, fault))
        for team in TEAMS
        for fault in ("deaf", "mute")
    ]
    return [*faults, Task("words/cost", _cost, alone=True)]


def _planned(team: str, gains: str | None = None) -> tuple[CompiledTransport, Sequence[HarmonicMap]]:
    """Return a shipped transport along its plan, ready to run."""
    scenario = with_gains(load_scenario(team), gains)
    scenario = replace(
        scenario,
        deployment=deployment_of({**_DEPLOYMENT, "budget": "none" if gains else "all"}),
        limits=_LIMITS,
    )
    result = plan(scenario)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan to measure runs of: {result.reason}")
    maps = build_maps(result.plan)
    transport = prepare(scenario, result.plan, maps)
    run(transport)  # What it compiles is compiled.
    return transport, maps


def _parted(team: str, fault: str, _: Sequence[Row]) -> list[Row]:
    """Return how many runs arrived and were held, and how far nominal positions of robots were apart."""
    transport, _maps = _planned(team)
    undisturbed, motion = run(transport), transport.plan.motion
    assert motion is not None  # as in every plan of a team that passes
    random, outcomes = np.random.default_rng(0), []
    for seed in range(RUNS):
        at, robot = random.uniform(0.0, motion.duration), int(random.integers(len(transport.robot_names)))
        failing = {"deaf": Deafness(at, DURATION)} if fault == "deaf" else {"silence": Silence(at, DURATION)}
        signs = random.choice([-CLOCKS, CLOCKS], len(transport.robot_names))
        robots = {
            name: RobotDepartures(clock_error=float(signs[k]), **(failing if k == robot else {}))
            for k, name in enumerate(transport.robot_names)
        }
        deployment = replace(transport.scenario.deployment, robots=robots, seed=seed)
        outcomes.append(run(transport, deployment))
    held, name = [outcome.held for outcome in outcomes], f"words/{team}/{fault}"
    slowest = max(outcome.time for outcome in outcomes)
    return [
        Row(f"{name}/arrived", sum(outcome.arrived for outcome in outcomes), "runs", "all", RUNS),
        Row(f"{name}/held", sum(number > 0 for number in held), "runs"),
        Row(f"{name}/most_holds", max(held), "holds"),
        Row(f"{name}/apart", 1e3 * max(outcome.spread for outcome in outcomes), "mm, nominal positions"),
        Row(f"{name}/slowest", slowest, "s", "no fault", undisturbed.time),
        Row(f"{name}/budget_share", max(outcome.budget_share for outcome in outcomes), "of the budget"),
    ]


def _cost(_: Sequence[Row]) -> list[Row]:
    """Return processor times of a run of ``base``: passing and resting, in the compiled loop and in Drake."""
    rows = []
    for way, gains in (("pass", None), ("rest", "scheduled")):
        transport, maps = _planned("base", gains)
        compiled = _seconds(partial(run, transport))
        drake = _seconds(partial(_simulate, transport.scenario, transport, maps))
        name = f"words/cost/{way}"
        rows.append(Row(f"{name}/compiled", 1e3 * compiled, "ms", "Drake's loop", 1e3 * drake))
        rows.append(Row(f"{name}/simulated", run(transport).time, "s"))
    return rows


def _simulate(scenario: Scenario, transport: CompiledTransport, maps: Sequence[HarmonicMap]) -> None:
    simulate(scenario, transport.plan, maps)


def _seconds(work: Any) -> float:
    """Return the processor time of some work once it has compiled what it needs [s]."""
    work()
    begun, compiling = process_time(), COMPILING.cpu_seconds
    work()
    return process_time() - begun - COMPILING.cpu_seconds + compiling
