"""What a robot in a process of its own costs: runs in lock-step beside the same runs in one process."""

from __future__ import annotations

import resource
from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter

from benchmarks.ring_teams import ring_transport
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.answers.log import SimulationLog
from coop_drake.nodes import simulate_in_processes
from coop_drake.scenario import Deployment, Scenario
from coop_drake.simulation import Sample, simulate

__all__ = ["apart_tasks", "costs"]

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
