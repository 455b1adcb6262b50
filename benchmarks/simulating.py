"""How fast the closed loop runs, beside real time and the bare plant, and what it leaves in memory."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from resource import getpagesize
from time import process_time
from typing import NamedTuple

from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from benchmarks.isolated import in_own_process
from benchmarks.ring_teams import ring_transport
from benchmarks.rows import Row
from benchmarks.tasks import Task
from benchmarks.transport import base_transport
from coop_drake.answers import Plan
from coop_drake.diagram import build_closed_loop
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.plant import build_team_plant, set_configuration
from coop_drake.scenario import Deployment, Scenario
from coop_drake.simulation import configure_simulator, simulate

_FIXED_STEP_SCHEMES = ("explicit_euler", "runge_kutta2")
_TEAMS = (2, 3, 4, 8)
_RATE = 200.0
_HORIZON = 3.0
_REPEATS = 5
_RUNS = 100
_SHORT = 0.05
_LIMIT = 300.0

Transport = tuple[Scenario, Plan, Sequence[HarmonicMap]]


class LoopCost(NamedTuple):
    """What a loop alone costs, without the watch that checks and logs every step.

    Attributes:
        evaluations: How many times derivatives were evaluated.
        seconds: CPU time of the loop [s].
        bare_evaluations: How many times those of the plant alone were, in steps of the loop's mean length.
        bare_seconds: CPU time of the plant alone [s].
    """

    evaluations: int
    seconds: float
    bare_evaluations: int
    bare_seconds: float


def simulating_tasks() -> list[Task]:
    """Everything there is to measure about simulations."""
    return [
        Task("simulating/base", lambda rows: _rows("base", base_transport()), alone=True),
        *(_ring_task(robots) for robots in _TEAMS),
        Task("simulating/memory", lambda rows: _memory_rows(), alone=True),
    ]


def loop_cost(transport: Transport, horizon: float) -> LoopCost:
    """Run a loop without its watch, then the plant alone with as many evaluations over the same time.

    Args:
        transport: Scenario, plan and maps.
        horizon: Simulated time [s].
    """
    scenario, plan, _ = transport
    loop = build_closed_loop(*transport)
    try:
        simulator = Simulator(loop.diagram, loop.create_context())
        configure_simulator(simulator, scenario)
        simulator.Initialize()
        start = process_time()
        simulator.AdvanceTo(horizon)
        seconds = process_time() - start
        integrator = simulator.get_integrator()
        evaluations, steps = integrator.get_num_derivative_evaluations(), simulator.get_num_steps_taken()
    finally:
        loop.release()
    return LoopCost(evaluations, seconds, *_bare_plant(scenario, plan, horizon, horizon / steps))


def _ring_task(robots: int) -> Task:
    def measure(_: Sequence[Row]) -> list[Row]:
        with ring_transport(robots) as transport:
            return _rows(f"ring_of_{robots}", transport)

    return Task(f"simulating/ring_of_{robots}", measure, alone=True)


def _rows(team: str, transport: Transport) -> list[Row]:
    rows: list[Row] = []
    for rate in (None, _RATE):
        mode = "continuous" if rate is None else f"{rate:g}_Hz"
        rows.extend(_mode_rows(f"simulating/{team}/{mode}", _at(transport, rate)))
    return rows


def _at(transport: Transport, rate: float | None) -> Transport:
    scenario, plan, maps = transport
    return replace(scenario, deployment=Deployment(control_rate=rate)), plan, maps


def _mode_rows(name: str, transport: Transport) -> list[Row]:
    """One evaluation beside the bare plant's; real time over CPU time of the loop alone and of whole runs."""
    costs = [loop_cost(transport, _HORIZON) for _ in range(_REPEATS)]
    # A machine's slow moments must not fall on one side alone.
    cost = min(costs, key=lambda cost: cost.seconds)
    bare = min(costs, key=lambda cost: cost.bare_seconds)
    start = process_time()
    log = simulate(*transport)
    seconds, simulated = process_time() - start, float(log.times[-1])
    each, bare_each = cost.seconds / cost.evaluations, bare.bare_seconds / bare.bare_evaluations
    return [
        Row(f"{name}/evaluation", 1e6 * each, "us", "bare plant", 1e6 * bare_each),
        Row(f"{name}/evaluations_a_second", cost.evaluations / _HORIZON, "1/s"),
        Row(f"{name}/loop_times_real_time", _HORIZON / cost.seconds, ""),
        Row(f"{name}/run_times_real_time", simulated / seconds, ""),
        Row(f"{name}/run", seconds, "s", "simulated time", simulated),
    ]


def _bare_plant(scenario: Scenario, plan: Plan, simulated: float, step: float) -> tuple[int, float]:
    """Evaluations, and shortest CPU time [s], of the drifting team without controllers."""
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    diagram = builder.Build()

    def once() -> tuple[int, float]:
        simulator = Simulator(diagram)
        context = team.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        set_configuration(team, context, plan.start)
        team.plant.get_actuation_input_port().FixValue(context, [0.0] * len(team.joints))
        ResetIntegratorFromFlags(simulator, scenario.simulator.integration_scheme, step)
        integrator = simulator.get_mutable_integrator()
        if scenario.simulator.integration_scheme not in _FIXED_STEP_SCHEMES:
            # With an error control that lets every step pass: in fixed steps Drake takes the derivatives at
            # a step's end for those at the next one's beginning, which it does not do in the loop.
            integrator.set_target_accuracy(1.0)
            integrator.set_requested_minimum_step_size(step)
            integrator.set_throw_on_minimum_step_size_violation(False)
        simulator.Initialize()
        start = process_time()
        simulator.AdvanceTo(simulated)
        seconds = process_time() - start
        return integrator.get_num_derivative_evaluations(), seconds

    return min((once() for _ in range(_REPEATS)), key=lambda cost: cost[1])


def _memory_rows() -> list[Row]:
    first, growth = in_own_process(memory_growth, limit=_LIMIT).value or (0.0, 0.0)
    return [Row("simulating/memory/growth_a_run", growth, "kB", "first run", first)]


def memory_growth() -> tuple[float, float]:
    """Resident memory after the first short runs, and by how much each of a hundred more adds to it [kB]."""
    scenario, plan, maps = base_transport()
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=_SHORT))
    with _collected():
        for _ in range(5):
            simulate(brief, plan, maps)
    first = _resident_kb()
    with _collected():
        for _ in range(_RUNS):
            simulate(brief, plan, maps)
    return first, (_resident_kb() - first) / _RUNS


@contextmanager
def _collected() -> Iterator[None]:
    yield
    gc.collect()


def _resident_kb() -> float:
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * getpagesize() / 1e3
