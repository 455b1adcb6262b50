"""Blocks that exchange words: channels, the cell planner, the clock and the blocks of a hold."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ZeroOrderHold

from coop_drake import systems
from coop_drake.laws.axis_table import ENERGY_BOUND, track_row
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.ppc import HOLD_RATE, SETTLING_TIME
from coop_drake.systems.messages import RELEASE
from tests.support.small_plan import small_plan
from tests.support.system_checks import context_with, evaluate, port_sizes

PERIOD = 0.1

NEVER = [-1.0, -1.0]


class Clock(LeafSystem):
    """Reports (number of the period, 1)."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("report", 2, self._write)

    def _write(self, context, output):
        output.SetFromVector([round(context.get_time() / PERIOD), 1.0])


def heard(channel, periods=12):
    """Which report stands after every period."""
    builder = DiagramBuilder()
    builder.AddSystem(channel)
    builder.Connect(builder.AddSystem(Clock()).get_output_port(), channel.get_input_port())
    simulator = Simulator(builder.Build())
    numbers = []
    for period in range(periods):
        simulator.AdvanceTo((period + 0.5) * PERIOD)
        context = channel.GetMyContextFromRoot(simulator.get_context())
        numbers.append(channel.get_output_port().Eval(context)[0])
    return numbers


@pytest.mark.parametrize(
    ("arguments", "periods"),
    [
        ({}, 0),
        ({"delay": 0.1}, 1),
        ({"delay": 0.3}, 3),
        ({"delay": 0.25}, 3),
        ({"delay": 0.30000000000000004}, 3),
        ({"delay": 0.2, "repeat": 1.0}, 2),  # it arrives again one delay later, but the newest counts
        ({"loss": 1.0}, 12),
    ],
)
def test_a_channel_passes_on_after_whole_periods_of_delay(arguments, periods):
    channel = systems.MessageChannel(PERIOD, **arguments)
    assert not channel.HasAnyDirectFeedthrough()
    np.testing.assert_array_equal(evaluate(channel, {"sent": [4.0, 1.0]}, "heard"), NEVER)
    assert whole_periods(arguments.get("delay", 0.0), PERIOD) == periods % 12
    assert heard(channel) == [-1.0] * periods + list(range(12 - periods))


def test_a_lost_report_leaves_the_last_one_standing():
    numbers = heard(systems.MessageChannel(PERIOD, loss=0.5, seed=1), periods=200)
    arrived = [n for period, n in enumerate(numbers) if n == period]
    assert 70 < len(arrived) < 130
    assert numbers == [max((n for n in arrived if n <= period), default=-1.0) for period in range(200)]


def test_where_newer_reports_are_lost_a_repeated_one_is_heard_again():
    """Even after a newer one: a report sent in period n arrives in n + 2, and once more in n + 4."""
    arguments = {"delay": 0.2, "loss": 0.6, "seed": 5}
    plain = heard(systems.MessageChannel(PERIOD, **arguments), periods=100)
    arrived = {n for n in range(98) if plain[n + 2] == n}
    expected, last = [], -1.0
    for period in range(100):
        last = next((n for n in (period - 2, period - 4) if n in arrived), last)
        expected.append(last)
    assert heard(systems.MessageChannel(PERIOD, repeat=1.0, **arguments), periods=100) == expected
    assert expected != sorted(expected)


def test_a_seed_decides_and_every_run_is_the_same():
    channel = systems.MessageChannel(PERIOD, loss=0.5, seed=7)
    first = heard(channel, 60)
    assert heard(systems.MessageChannel(PERIOD, loss=0.5, seed=7), 60) == first
    assert heard(systems.MessageChannel(PERIOD, loss=0.5, seed=8), 60) != first


def advance(planner, context, until):
    simulator = Simulator(planner, context)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return list(planner.GetOutputPort("current_cell").Eval(simulator.get_context()))


def test_a_plan_starts_in_its_first_cell():
    np.testing.assert_array_equal(evaluate(systems.CellPlanner(2, 3), {}, "current_cell"), [0.0, 0.0])


@pytest.mark.parametrize(
    ("ready", "cell"),
    [
        ([(0, 0.3), (0, 0.1)], 1),
        ([(0, 0.0), (0, 0.0)], 1),
        ([(0, 0.3), (0, -0.1)], 0),
        ([(0, -0.3), (0, 0.1)], 0),
        ([(-1, 0.3), (0, 0.1)], 0),
        ([(1, 0.3), (1, 0.1)], 0),
        ([(0, np.nan), (0, 0.1)], 0),
    ],
)
def test_it_advances_once_when_all_reports_speak_of_the_current_cell(ready, cell):
    planner = systems.CellPlanner(2, 3)
    context = context_with(planner, {f"robot_{k}_ready": value for k, value in enumerate(ready)})
    # A report that speaks of cell 0 is stale in cell 1: further steps change nothing.
    assert advance(planner, context, 0.5)[0] == cell


def test_the_entry_time_is_the_time_of_the_switch():
    planner = systems.CellPlanner(1, 3)
    context = context_with(planner, {"robot_0_ready": [0.0, 1.0]}, time=2.5)
    assert advance(planner, context, 2.6) == [1.0, 2.5]


def test_it_stays_in_the_last_cell_and_says_when_all_have_arrived():
    planner = systems.CellPlanner(2, 1)
    ready = {"robot_0_ready": [0.0, 1.0], "robot_1_ready": [0.0, 1.0]}
    context = context_with(planner, ready)
    assert advance(planner, context, 0.1) == [0.0, 0.0]
    assert evaluate(planner, ready, "arrived") == [1.0]
    assert evaluate(planner, {**ready, "robot_1_ready": [0.0, -1.0]}, "arrived") == [0.0]
    assert evaluate(systems.CellPlanner(2, 2), ready, "arrived") == [0.0]


class Echo(LeafSystem):
    """A robot that is always ready for whatever cell is current."""

    def __init__(self):
        super().__init__()
        cell = self.DeclareVectorInputPort("current_cell", 2)
        self.DeclareVectorOutputPort(
            "ready", 2, lambda context, output: output.SetFromVector([cell.Eval(context)[0], 1.0])
        )


def wired(planner, channel):
    """The planner with one eager robot; ``channel`` may hold its reports back."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("planner", planner)
    robot = builder.AddNamedSystem("robot", Echo())
    builder.Connect(planner.GetOutputPort("current_cell"), robot.GetInputPort("current_cell"))
    source = robot.GetOutputPort("ready")
    if channel is not None:
        builder.AddNamedSystem("channel", channel)
        builder.Connect(source, channel.get_input_port())
        source = channel.get_output_port()
    builder.Connect(source, planner.GetInputPort("robot_0_ready"))
    return builder.Build()


def test_reports_that_depend_on_the_cell_close_no_algebraic_loop():
    diagram = wired(systems.CellPlanner(1, 3), None)
    assert not diagram.HasAnyDirectFeedthrough()


def test_a_channel_that_holds_samples_never_switches_twice_on_one_report():
    planner = systems.CellPlanner(1, 9, period=0.01)
    channel = ZeroOrderHold(period_sec=0.03, offset_sec=0.0, vector_size=2)
    diagram = wired(planner, channel)
    context = diagram.CreateDefaultContext()
    held = channel.GetMyMutableContextFromRoot(context)
    held.SetDiscreteState([-1.0, 1.0])
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    cells = []
    for step in range(1, 13):
        simulator.AdvanceTo(0.01 * step + 0.005)
        cells.append(int(planner.GetMyContextFromRoot(context).get_discrete_state_vector()[0]))
    # The first sample reaches the planner one period late; then one switch for each new sample.
    assert cells == [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]


HELD_PLAN = small_plan(("a",))


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
    clock = systems.FunnelClock(period)
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
    monitor = systems.HoldMonitor(systems.axis_laws(HELD_PLAN, [0, 1]), 2.0)
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


def test_a_robot_asks_above_its_limit_until_the_energy_is_a_share_of_it():
    law, asked = systems.axis_laws(HELD_PLAN, [0, 1])[0], {}
    monitor = systems.HoldMonitor([law], 2.0)
    simulator = Simulator(monitor, context_with(monitor, MIDDLE))
    request = monitor.GetOutputPort("hold_request")
    for rates, wanted in ((np.arange(0.0, 3.0, 0.002), 1.0), (np.arange(3.0, 0.0, -0.002), 0.0)):
        for rate in rates:
            state = [*MIDDLE["object_state"][:5], rate]
            until = simulator.get_context().get_time() + 1e-6
            if request.Eval(advanced(simulator, until, object_state=state))[0] == wanted:
                energy = track_row(law.table[0], until, 0.2, rate)[1]
                asked[wanted] = energy / law.table[0, ENERGY_BOUND]
                break
    assert asked[1.0] == pytest.approx(2.0, rel=0.02)
    assert asked[0.0] == pytest.approx(2.0 * RELEASE, rel=0.02)


def test_a_robot_that_hears_nothing_holds_by_itself():
    receiver = systems.HoldReceiver(0.1, period=0.01)
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
    waiting = systems.HoldReceiver()
    assert evaluate(waiting, {"hold_message": [-1.0, -1.0]}, "hold") == 0.0
    simulator = Simulator(waiting, context_with(waiting, {"hold_message": [0.0, 1.0]}))
    assert waiting.GetOutputPort("hold").Eval(advanced(simulator, 9.0))[0] == 0.0


def test_without_a_limit_no_robot_asks():
    monitor = systems.HoldMonitor(systems.axis_laws(HELD_PLAN, [0, 1]), None)
    inputs = {**MIDDLE, "energy_margin": [-1.0], "object_state": [3.0, 3.0, 0.2, 0.0, 0.0, 99.0]}
    simulator = Simulator(monitor, context_with(monitor, inputs))
    assert monitor.GetOutputPort("hold_request").Eval(advanced(simulator, 0.5))[0] == 0.0


def test_the_supervisor_holds_for_every_cause_and_pauses_a_little_longer():
    supervisor = systems.HoldSupervisor(2, silence=0.35, period=0.1)
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
