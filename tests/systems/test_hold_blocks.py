"""The blocks of a hold: the funnels' clock, a robot's request, and the supervisor."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.laws.ppc import HOLD_RATE, SETTLING_TIME
from coop_drake.systems import FunnelClock, HoldMonitor, HoldReceiver, HoldSupervisor, axis_laws
from tests.support.small_plan import small_plan
from tests.support.system_checks import context_with, evaluate, port_sizes

PLAN = small_plan(("a",))
MIDDLE = {
    "object_state": [3.0, 3.0, 0.2, 0.0, 0.0, 0.0],
    "robot_state": [1.0, 2.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
    "current_cell": [0.0, 0.0],
    "clock": [0.0, 1.0, 0.0],
    "energy_margin": [0.4],
    "missed": [0.0],
}


def advanced(simulator, until, **inputs):
    """Advance with new values of inputs, and return the context."""
    context = simulator.get_mutable_context()
    for name, value in inputs.items():
        simulator.get_system().GetInputPort(name).FixValue(context, value)
    simulator.AdvanceTo(until)
    return simulator.get_context()


@pytest.mark.parametrize("period", [None, 0.01])
def test_a_clock_stands_still_while_held_and_counts_from_the_entry(period):
    clock = FunnelClock(period)
    assert port_sizes(clock) == ({"hold": 1, "current_cell": 2}, {"clock": 3})
    simulator = Simulator(clock, context_with(clock, {"hold": [0.0], "current_cell": [0.0, 0.0]}))
    output = clock.GetOutputPort("clock")
    np.testing.assert_array_equal(output.Eval(advanced(simulator, 1.0)), [0.0, 1.0, 0.0])
    lag, pace, _ = output.Eval(advanced(simulator, 4.0, hold=[1.0]))
    assert lag == pytest.approx(3.0 - 2.0 / HOLD_RATE, abs=0.011)
    assert 0.0 <= pace < 1e-6
    lag, pace, _ = output.Eval(advanced(simulator, 7.0, hold=[0.0]))
    assert lag == pytest.approx(3.0, abs=0.011)
    assert pace > 1.0 - 1e-6
    np.testing.assert_allclose(
        output.Eval(advanced(simulator, 8.0, current_cell=[1.0, 7.5])), [0.0, 1.0, 0.0], atol=1e-6
    )


def test_a_robot_asks_when_its_energy_is_too_large_or_its_margin_negative():
    monitor = HoldMonitor(axis_laws(PLAN, [0, 1]), 2.0)
    assert port_sizes(monitor)[1] == {"hold_request": 2}
    simulator = Simulator(monitor, context_with(monitor, MIDDLE))
    request = monitor.GetOutputPort("hold_request")
    asks, number = request.Eval(advanced(simulator, 1e-3))
    assert asks == 0.0
    assert request.Eval(advanced(simulator, 2e-3, object_state=[3.0, 3.0, 0.2, 0.0, 0.0, 9.0]))[0] == 1.0
    asks, later = request.Eval(advanced(simulator, 3e-3, object_state=MIDDLE["object_state"]))
    assert (asks, later > number) == (0.0, True)
    assert request.Eval(advanced(simulator, 4e-3, energy_margin=[-1e-9]))[0] == 1.0
    assert request.Eval(advanced(simulator, 5e-3, energy_margin=[0.4]))[0] == 0.0
    assert request.Eval(advanced(simulator, 6e-3, missed=[1.0]))[0] == 1.0


def test_a_robot_that_hears_nothing_holds_by_itself():
    receiver = HoldReceiver(0.1, period=0.01)
    assert port_sizes(receiver) == ({"hold_message": 2}, {"hold": 1, "missed": 1})
    simulator = Simulator(receiver, context_with(receiver, {"hold_message": [0.0, 1.0]}))

    def outputs(until, **inputs):
        context = advanced(simulator, until, **inputs)
        return [receiver.GetOutputPort(name).Eval(context)[0] for name in ("hold", "missed")]

    assert outputs(0.095) == [0.0, 0.0]
    assert outputs(0.105, hold_message=[0.0, 2.0]) == [0.0, 0.0]
    assert outputs(0.195) == [0.0, 0.0]
    assert outputs(0.255) == [1.0, 1.0]
    assert outputs(0.275, hold_message=[1.0, 3.0]) == [1.0, 0.0]
    assert outputs(0.295, hold_message=[0.0, 4.0]) == [0.0, 0.0]
    waiting = HoldReceiver()
    assert evaluate(waiting, {"hold_message": [-1.0, -1.0]}, "hold") == 0.0
    simulator = Simulator(waiting, context_with(waiting, {"hold_message": [0.0, 1.0]}))
    assert waiting.GetOutputPort("hold").Eval(advanced(simulator, 9.0))[0] == 0.0


def test_without_a_limit_no_robot_asks():
    monitor = HoldMonitor(axis_laws(PLAN, [0, 1]), None)
    inputs = {**MIDDLE, "energy_margin": [-1.0], "object_state": [3.0, 3.0, 0.2, 0.0, 0.0, 99.0]}
    simulator = Simulator(monitor, context_with(monitor, inputs))
    assert monitor.GetOutputPort("hold_request").Eval(advanced(simulator, 0.5))[0] == 0.0


def test_the_supervisor_holds_for_every_cause_and_pauses_a_little_longer():
    supervisor = HoldSupervisor(2, silence=0.35, period=0.1)
    quiet = {"order": [0.0], "robot_0_request": [0.0, 1.0], "robot_1_request": [0.0, 1.0]}
    assert port_sizes(supervisor) == (
        {"order": 1, "robot_0_request": 2, "robot_1_request": 2},
        {"hold": 1, "hold_message": 2, "paused": 1, "causes": 3},
    )
    assert evaluate(supervisor, quiet, "paused") == 0.0
    simulator = Simulator(supervisor, context_with(supervisor, quiet))

    def outputs(until, **inputs):
        context = advanced(simulator, until, **inputs)
        return [list(supervisor.GetOutputPort(name).Eval(context)) for name in ("hold", "paused", "causes")]

    assert outputs(0.25) == [[0.0], [0.0], [0.0, 0.0, 0.0]]
    assert outputs(0.35, order=[1.0]) == [[1.0], [1.0], [1.0, 0.0, 0.0]]
    held, number = supervisor.GetOutputPort("hold_message").Eval(simulator.get_context())
    assert outputs(0.65, robot_0_request=[1.0, 2.0]) == [[1.0], [1.0], [1.0, 2.0, 3.0]]
    assert list(supervisor.GetOutputPort("hold_message").Eval(simulator.get_context())) == [held, number + 3]
    now = {"order": [0.0], "robot_0_request": [0.0, 3.0], "robot_1_request": [0.0, 2.0]}
    assert outputs(0.75, **now) == [[0.0], [1.0], [0.0, 0.0, 0.0]]
    later = {"robot_0_request": [0.0, 4.0], "robot_1_request": [0.0, 3.0]}
    for k in range(1, 12):  # messages keep arriving
        outputs(0.75 + 0.1 * k, **{name: [0.0, number + k] for name, (_, number) in later.items()})
    assert outputs(0.75 + SETTLING_TIME + 0.15)[:2] == [[0.0], [0.0]]
