"""Blocks of what is measured: errors, ages, losses, predictions, disturbances and interruptions."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from coop_drake import systems
from coop_drake.laws.measurements import predict, wanted_accelerations, write_errors
from coop_drake.plant import build_robot_plant, robot_chain
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import context_with, evaluate

PERIOD = 0.1


def used(sensor, periods=200, offset=0.0):
    """Number of the measurement that a controller uses in each period; measurements are k at time k."""
    builder = DiagramBuilder()
    builder.AddSystem(sensor)
    ramp = PiecewisePolynomial.FirstOrderHold([-1.0, 1e3], [[-1.0 / PERIOD, 1e3 / PERIOD]])
    source = builder.AddSystem(TrajectorySource(ramp))
    hold = builder.AddSystem(ZeroOrderHold(PERIOD, 1, offset))
    builder.Connect(source.get_output_port(), sensor.get_input_port())
    builder.Connect(sensor.get_output_port(), hold.get_input_port())
    simulator, numbers = Simulator(builder.Build()), []
    for period in range(periods):
        simulator.AdvanceTo((period + 0.5) * PERIOD + offset)
        context = hold.GetMyContextFromRoot(simulator.get_context())
        numbers.append(hold.get_output_port().Eval(context)[0] - offset / PERIOD)
    return np.array(numbers)


@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_the_last_measurement_stands_in_for_lost_ones(offset):
    numbers = used(systems.LossyMeasurement(1, PERIOD, loss=0.5, offset=offset, seed=3), offset=offset)
    arrived = [n for n in range(200) if abs(numbers[n] - n) < 1e-6]
    assert 70 < len(arrived) < 130
    first = arrived[0]
    expected = [max(n for n in arrived if n <= period) for period in range(first, 200)]
    np.testing.assert_allclose(numbers[first:], expected, atol=1e-6)


@pytest.mark.parametrize("late_by", [0.0, 0.1, 0.25])
def test_late_ones_are_used_when_they_arrive_unless_a_newer_one_has(late_by):
    periods = {0.0: 1, 0.1: 1, 0.25: 3}[late_by]
    numbers = used(systems.LossyMeasurement(1, PERIOD, late=0.7, late_by=late_by, seed=5))
    on_time = [n for n in range(200) if abs(numbers[n] - n) < 1e-6]
    assert 35 < len(on_time) < 90
    for period in range(10, 200):
        arrived = [n for n in range(period + 1) if n in on_time or n + periods <= period]
        assert numbers[period] == pytest.approx(max(arrived))


def test_nothing_new_arrives_when_all_is_lost_and_its_state_at_rest_is_used():
    sensor = systems.LossyMeasurement(2, PERIOD, loss=1.0)
    assert evaluate(sensor, {"measured": [4.0, 5.0]}, "received").tolist() == [0.0, 0.0]
    context = sensor.CreateDefaultContext()
    context.SetDiscreteState(sensor.state_at_rest(np.array([1.0, 2.0])))
    assert sensor.get_output_port().Eval(context).tolist() == [1.0, 2.0]


@pytest.mark.parametrize(("time", "number"), [(0.0, 0), (0.05, 0), (0.3, 3), (0.7 - 1e-12, 7)])
def test_errors_are_those_of_the_number_of_the_period(time, number):
    errors = np.empty(3)
    write_errors(4, DEVIATIONS, WAVES, number, errors)
    block = systems.MeasurementNoise(DEVIATIONS, WAVES, PERIOD, 4)
    measured = evaluate(block, {"exact": [1.0, 2.0, 3.0]}, "measured", time)
    np.testing.assert_allclose(measured, np.array([1.0, 2.0, 3.0]) + errors, atol=1e-15)


DEVIATIONS = np.array([0.0, 0.5, 2.0])
WAVES = np.array([[0.3, 4.0, 0.0], [0.0, 1.0, 0.0], [0.1, 3.0, 0.5]])


@pytest.mark.parametrize(("share", "measured"), [(0.25, [2.5, -1.5]), (1.0, [1.0, 0.0]), (-0.5, [4.0, -3.0])])
def test_it_shows_what_was_or_will_be_by_the_motion_of_the_last_period(share, measured):
    block = systems.ShiftedMeasurement(2, share, PERIOD)
    context = block.CreateDefaultContext()
    block.GetInputPort("exact").FixValue(context, [1.0, 0.0])
    context.SetDiscreteState(block.EvalUniquePeriodicDiscreteUpdate(context))
    block.GetInputPort("exact").FixValue(context, [3.0, -2.0])
    np.testing.assert_allclose(block.GetOutputPort("measured").Eval(context), measured, atol=1e-15)


def test_an_angle_that_jumps_by_a_turn_is_shifted_as_one_that_goes_on():
    block = systems.ShiftedMeasurement(3, 0.5, PERIOD)
    context = block.CreateDefaultContext()
    block.GetInputPort("exact").FixValue(context, [0.0, 0.0, -np.pi + 0.01])
    context.SetDiscreteState(block.EvalUniquePeriodicDiscreteUpdate(context))
    block.GetInputPort("exact").FixValue(context, [0.0, 0.0, np.pi - 0.03])
    measured = block.GetOutputPort("measured").Eval(context)[2]
    assert np.angle(np.exp(1j * (measured - np.pi + 0.01))) == pytest.approx(0.0, abs=1e-12)


def test_what_rests_is_measured_as_it_is():
    assert evaluate(systems.ShiftedMeasurement(1, 0.7, PERIOD), {"exact": [0.0]}, "measured", 0.3) == [0.0]


def given(block, times):
    """Output at some times for the input (1 + t, -t)."""
    builder = DiagramBuilder()
    builder.AddSystem(block)
    line = PiecewisePolynomial.FirstOrderHold([0.0, 10.0], [[1.0, 11.0], [0.0, -10.0]])
    builder.Connect(builder.AddSystem(TrajectorySource(line)).get_output_port(), block.get_input_port())
    simulator, values = Simulator(builder.Build()), []
    for time in times:
        simulator.AdvanceTo(time)
        values.append(block.get_output_port().Eval(block.GetMyContextFromRoot(simulator.get_context())))
    return np.array(values)


@pytest.mark.parametrize(("held", "during"), [(True, [1.9, -0.9]), (False, [0.0, 0.0])])
def test_a_signal_fails_for_its_interval_alone(held, during):
    block = systems.Interruption(2, PERIOD, begin=1.0, duration=0.5, held=held)
    found = given(block, [0.55, 1.0, 1.25, 1.45, 1.5, 1.75])
    expected = [[1.55, -0.55], during, during, during, [2.5, -1.5], [2.75, -1.75]]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_without_a_duration_it_never_comes_back():
    assert np.all(given(systems.Interruption(2, PERIOD, begin=0.0, held=False), [0.0, 1.0, 9.0]) == 0.0)


def test_what_is_held_from_the_start_is_what_was_before():
    block = systems.Interruption(2, 0.1, begin=0.0, held=True, before=-1.0)
    np.testing.assert_array_equal(evaluate(block, {"wanted": [3.0, 4.0]}, "given"), [-1.0, -1.0])


def test_commands_are_those_wanted_less_the_disturbance():
    block, ahead = systems.DisturbanceObserver(1, 5.0, 1.0), np.array([0.1, 0.1, -0.1, 0.2])
    inputs = {
        "object_state": [9.0, 9.0, 9.0, 0.1, 0.2, 0.3],
        "robot_state": [9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 0.4],
        "governor_command": [7.0, 8.0, 1.0, 2.0],
        "axis_acceleration": [3.0, 4.0],
        "observed_rates": [0.0, 0.1, 0.4, 0.2],
    }
    for name, expected in (
        ("disturbance", 5.0 * ahead),
        ("observer_rate", ahead + np.arange(1.0, 5.0)),
        ("compensated_command", [7.0, 8.0, 1.0 - 5.0 * ahead[0], 2.0 - 5.0 * ahead[1]]),
        ("compensated_axes", [3.0, 4.0] - 5.0 * ahead[2:]),
    ):
        np.testing.assert_allclose(evaluate(block, inputs, name), expected)


SAMPLE = 0.01


LOAD = np.array([0.3, 0.1, 0.0, 0.0, 1.0, 0.5, 0.5])


INPUTS = {
    "robot_state": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8],
    "object_pose": [1.0, 2.0, 0.5],
    "governor_command": [9.0, 9.0, 1.5, -0.5],
    "axis_acceleration": [0.7, -0.9],
}


@pytest.fixture(scope="module")
def robot():
    return build_robot_plant(small_scenario("base"), 0)


def test_it_predicts_by_what_was_commanded_in_the_last_periods(robot):
    block = systems.StatePredictor(robot, LOAD, 2, SAMPLE)
    simulator = Simulator(block, context_with(block, INPUTS))
    state, pose = np.array(INPUTS["robot_state"]), np.array(INPUTS["object_pose"])
    rows, chain = np.zeros((2, 7)), robot_chain(robot)
    for update in range(5):
        simulator.AdvanceTo((update + 0.5) * SAMPLE)
        predicted, predicted_pose, now = np.empty(8), np.empty(3), np.empty(7)
        predict(chain, LOAD[:2], state, pose, rows, SAMPLE, predicted, predicted_pose)
        linear, axes = np.array([1.5, -0.5]), np.array([0.7, -0.9])
        wanted_accelerations(chain, LOAD, predicted, predicted_pose, linear, axes, now)
        rows = np.vstack([rows[1:], now])
        predict(chain, LOAD[:2], state, pose, rows, SAMPLE, predicted, predicted_pose)
        context = simulator.get_context()
        np.testing.assert_array_equal(block.GetOutputPort("predicted_state").Eval(context), predicted)
        np.testing.assert_array_equal(block.GetOutputPort("predicted_pose").Eval(context), predicted_pose)


@pytest.mark.parametrize("wrong", [(0, SAMPLE), (2, 0.0)])
def test_no_delay_and_no_period_are_refused(robot, wrong):
    with pytest.raises(ValueError, match="a delay of one period or more"):
        systems.StatePredictor(robot, LOAD, *wrong)
