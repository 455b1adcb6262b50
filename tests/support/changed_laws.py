"""Changes one law after the other and prints what changes with it, as JSON; needs NUMBA_DISABLE_JIT=1."""

from __future__ import annotations

import importlib
import json
import sys
from dataclasses import replace
from types import FunctionType

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.compiled_loop import CompiledTransport, prepare
from coop_drake.compiled_loop.arrays import robot_room, watch_room
from coop_drake.compiled_loop.loop import update
from coop_drake.compiled_loop.running import departures_of, memory_of
from coop_drake.compiled_loop.watching import begin_figures, watch
from coop_drake.diagram import build_closed_loop
from coop_drake.geometry.polygons import edges_of
from coop_drake.laws.axis_table import axis_table
from coop_drake.planning.duration import cross_cell
from coop_drake.plant import set_configuration
from coop_drake.scenario import Deployment
from coop_drake.simulation.run import blocking_margin
from coop_drake.simulation.telemetry import Telemetry
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import POSITION_TOLERANCE


def change(law: FunctionType) -> FunctionType:
    """Let a law return, or write into its last argument, other numbers; return the original."""
    original = FunctionType(law.__code__, law.__globals__, law.__name__, law.__defaults__)

    def changed(*arguments):
        result = __original__(*arguments)  # noqa: F821
        if result is None:
            arguments[-1][:] *= 1.1
            return None
        if isinstance(result, tuple):
            return tuple(1.1 * number - __shift__ for number in result)  # noqa: F821
        return result - __lowered__  # noqa: F821

    # A margin becomes the worst of all, so that nothing hides it; an energy changes a little.
    lowered = 10.0 if law.__module__.endswith("readiness") else 0.5
    shift = lowered if law.__module__.endswith("readiness") else 0.0
    law.__globals__.update(__original__=original, __lowered__=lowered, __shift__=shift)
    law.__code__, law.__defaults__ = changed.__code__, None
    return original


def restore(law: FunctionType, original: FunctionType) -> None:
    """Undo a change."""
    law.__code__, law.__defaults__ = original.__code__, original.__defaults__


class Loop:
    """A closed loop in the middle of a transition, moving, a short way behind its governor."""

    def __init__(self, plan: Plan) -> None:
        scenario, _ = small_problem()
        self.loop = build_closed_loop(scenario, plan, small_maps())

    def sample(self):
        """A fresh sample of all that the controllers compute."""
        loop, root = self.loop, self.loop.create_context()
        root.SetTime(0.1)
        plan, team = loop.plan, loop.team
        transition = plan.transitions[0]
        axes = 0.6 * transition.goal_lower + 0.4 * transition.goal_upper
        z = np.concatenate([transition.target - [0.3, 0.2], axes])
        rates = np.linspace(0.02, 0.05, len(z))
        set_configuration(team, team.plant.GetMyMutableContextFromRoot(root), z, rates)
        integrators = [law.GetSubsystemByName("governor_state") for law in loop.bare_controllers]
        for integrator in integrators:
            state = integrator.GetMyMutableContextFromRoot(root)
            integrator.set_integral_value(state, transition.target - [0.25, 0.18])
        self.rates = [
            integrator.EvalTimeDerivatives(integrator.GetMyContextFromRoot(root)).CopyToVector()
            for integrator in integrators
        ]
        return Telemetry(loop, root).read()

    def numbers(self):
        """All numbers that may depend on a law."""
        sample = self.sample()
        return np.concatenate(
            [
                *self.rates, sample.funnel_lower, sample.funnel_upper, [sample.energy_margin],
                sample.commanded_wrenches.ravel(), sample.base_wrenches.ravel(), sample.joint_torques,
                sample.ready_margins,
            ]
        )  # fmt: skip


def estimated(plan: Plan):
    """The state in which the time estimate leaves the first cell."""
    n = len(plan.start) - 2
    state = np.concatenate([plan.start[:2], np.zeros(2), plan.start[:2], plan.start[2:], np.zeros(n)])
    cells = [
        (edges_of(cell.tidied), plan.governor_row(k), axis_table(plan.funnel(k), transition.gains))
        for k, (cell, transition) in enumerate(zip(plan.cells[:2], plan.transitions[:2], strict=True))
    ]
    path = np.array([plan.start[:2], plan.transitions[0].target])
    edges, gains, table = cells[0]
    seconds = cross_cell(
        state, np.zeros(n), edges, path, gains, table, plan.transitions[0].inradius, *cells[1], False, 10.0,
        np.zeros(1 + 2 * n),
    )  # fmt: skip
    return np.array([*state, seconds])


def compiled_results(transport: CompiledTransport):
    """All that the compiled loop computes at a sample: of a team that moves, and of one that is ready."""
    plan, deployment = transport.plan, transport.scenario.deployment
    transition, found = plan.transitions[0], []
    middle = 0.5 * (transition.goal_lower + transition.goal_upper)
    n = len(plan.start)
    for axes, away, speed in ((0.9 * middle, 0.3, 0.03), (middle, 0.01, 0.0)):
        departures = departures_of(transport, deployment)
        memory, figures = memory_of(transport, departures), begin_figures()
        memory.state[transport.team.places[0]] = [*(transition.target - [away, 0.5 * away]), *axes]
        memory.state[transport.team.places[1]] = speed * np.linspace(0.5, 1.0, n)
        memory.governors[:] = transition.target - [0.8 * away, 0.3 * away]
        parts = transport.cells, transport.team, transport.plant, transport.nominal, departures, memory
        update(*parts[:2], *parts[3:-1], robot_room(transport.team, memory), memory, 40)
        watch(40, *parts, watch_room(transport.plant), figures)
        numbers = memory.efforts[0], memory.governors.ravel(), memory.reports[0].ravel(), figures
        found.append([repr(number) for row in numbers for number in row.tolist()])
    return found


def stalled(plan: Plan, sample):
    """The message about a team that is not ready, for each condition that may be the worst."""
    worse = [
        replace(sample, rates=0.6 * np.ones_like(sample.rates)),
        replace(sample, governor_position=sample.governor_position + 0.65),
    ]
    return [blocking_margin(plan, one, POSITION_TOLERANCE) for one in worse]


def main(names: list[str]) -> None:
    """Print, for every law (module:function), which results change with it."""
    scenario, plan = small_problem()
    sampled = replace(scenario, deployment=Deployment(control_rate=200.0))
    transport = prepare(sampled, plan, small_maps())
    named = Loop(plan)
    sample = named.sample()
    results = {
        "named": lambda: named.numbers().tolist(),
        "estimate": lambda: estimated(plan).tolist(),
        "compiled": lambda: compiled_results(transport),
        "stall": lambda: stalled(plan, sample),
    }
    before = {name: result() for name, result in results.items()}
    found = {}
    for name in names:
        module, function = name.split(":")
        law = getattr(importlib.import_module(module), function)
        original = change(law)
        found[name] = [result for result, compute in results.items() if compute() != before[result]]
        restore(law, original)
    assert {name: result() for name, result in results.items()} == before
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1:])
