"""How fast the closed loop runs, against real time and against the bare plant."""

from __future__ import annotations

from time import perf_counter

from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from benchmarks.rows import Row
from benchmarks.transport import base_transport
from coop_drake.planning import Plan
from coop_drake.plant import build_team_plant, set_configuration
from coop_drake.scenario import Scenario
from coop_drake.simulation import simulate

__all__ = ["bench_simulation"]

_FIXED_STEP_SCHEMES = ("explicit_euler", "runge_kutta2")


def bench_simulation() -> list[Row]:
    """Run the closed loop, then the plant alone with as many steps over the same simulated time."""
    scenario, plan, maps = base_transport()
    start = perf_counter()
    log = simulate(scenario, plan, maps)
    wall, simulated = perf_counter() - start, float(log.times[-1])
    steps = len(log.times) - 1
    bare = _bare_plant_seconds(scenario, plan, simulated, simulated / steps)
    bare_step = 1e3 * bare / steps
    return [
        Row("simulating/base/wall_seconds", wall, "s", "simulated time", simulated),
        Row("simulating/base/steps", steps, "steps"),
        Row("simulating/base/one_step", 1e3 * wall / steps, "ms", "bare plant", bare_step),
    ]


def _bare_plant_seconds(scenario: Scenario, plan: Plan, simulated: float, step: float) -> float:
    """Wall time [s] of the drifting team without controllers, at the closed loop's mean step."""
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = team.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    set_configuration(team, context, plan.start)
    team.plant.get_actuation_input_port().FixValue(context, [0.0] * len(team.joints))
    ResetIntegratorFromFlags(simulator, scenario.simulator.integration_scheme, step)
    if scenario.simulator.integration_scheme not in _FIXED_STEP_SCHEMES:
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.Initialize()
    start = perf_counter()
    simulator.AdvanceTo(simulated)
    return perf_counter() - start
