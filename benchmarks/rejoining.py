"""What killed processes cost a shipped team: how long it rests, how far it brakes, its smallest clearance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.departures import deployment_of, planned_transport
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Plan, SimulationLog, load_scenario
from coop_drake.apart import LocalTeam, network_of, run_world
from coop_drake.apart.messages import SUPERVISOR, name_of
from coop_drake.diagram import control_period
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.scenario import Scenario

KILLED: dict[str, tuple[tuple[int, float], ...]] = {
    "base": ((1, 1.5), (0, 3.0), (1, 5.0), (SUPERVISOR, 3.0)),
    "three": ((1, 1.5), (2, 4.0), (1, 5.0)),
    "elbow": ((1, 1.0), (0, 2.5), (1, 4.0)),
}
"""Who is killed, and when in the transport [s]: at different speeds, in wide and in narrow places."""

_AFTER = 4.0
"""Simulated time from the fault to the end of a run [s]: to brake, to rest, to go on, and some cells more."""

_PATIENCE = 30.0
"""How long a process may take for an answer [s]: nothing but the kill makes one missing on a busy machine."""


def rejoining_tasks() -> list[Task]:
    """One kill after the other, with the machine to itself."""
    return [
        Task(f"apart/kills/{team}_{label_of(index, at)}", partial(_rows, team, index, at), alone=True)
        for team, faults in KILLED.items()
        for index, at in faults
    ]


def label_of(index: int, at: float) -> str:
    """Return what rows are called in which a process fails at a time [s]."""
    return f"{name_of(index).removeprefix('the ').replace(' ', '_')}_at_{at:g}_s"


def _rows(team: str, index: int, at: float, _: Sequence[Row]) -> list[Row]:
    ideal = load_scenario(team)
    simulator = replace(ideal.simulator, max_time=at + _AFTER)
    deployment = deployment_of({"preset": "mobile_base"})
    scenario = replace(ideal, deployment=deployment, simulator=simulator)
    plan, maps = planned_transport(team, scenario.command_age, scenario)
    return killed(f"apart/kills/{team}_{label_of(index, at)}", scenario, plan, maps, index, at)


def killed(
    name: str, scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], index: int, at: float
) -> list[Row]:
    """Return the figures of a run in lock-step in which one process is killed and started again.

    Args:
        name: What the rows are called.
        scenario: The scenario, with a control rate.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        index: Who is killed.
        at: When, in simulated time [s].
    """
    network, facts = network_of(scenario, plan), dict[str, Any]()
    fault = round(at / control_period(scenario))
    with LocalTeam(scenario, plan, maps, network, restarts=1) as team:

        def kill(sample: int) -> None:
            if sample == fault:
                team.processes[index].kill()
                team.processes[index].join()

        log = run_world(
            scenario, plan, network, processes=team, before=kill, report=facts.update, patience=_PATIENCE
        )
    return [Row(f"{name}/{figure}", value, unit) for figure, value, unit in _figures(log, facts["stops"], at)]


def _figures(
    log: SimulationLog, stops: Sequence[Mapping[str, Any]], at: float
) -> Iterator[tuple[str, float, str]]:
    """Yield name, value and unit of each figure; the first two where the drives braked."""
    begin = int(np.searchsorted(log.times, at))
    for stop in stops[:1]:
        rest, resumed = np.searchsorted(log.times, [stop["rested"], stop["resumed"]])
        way = np.hypot(*(log.object_pose[rest, :2] - log.object_pose[begin, :2]))
        yield "rests_after", stop["rested"] - at, "s"
        yield "way", 1e3 * float(way), "mm"
        yield "goes_on_after", stop["resumed"] - at, "s"
        yield "clearance_while_braking", 1e3 * _clearance(log, slice(begin, int(resumed))), "mm"
    yield "clearance_before", 1e3 * _clearance(log, slice(0, begin)), "mm"
    yield "clearance_from_then_on", 1e3 * _clearance(log, slice(begin, None)), "mm"


def _clearance(log: SimulationLog, rows: slice) -> float:
    return float(min(log.workspace_clearance[rows].min(), log.body_clearance[rows].min()))
