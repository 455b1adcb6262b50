import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.systems import LossyMeasurement
from tests.support.system_checks import evaluate

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


def test_a_good_sensor_passes_all_on_at_once():
    np.testing.assert_allclose(used(LossyMeasurement(1, PERIOD)), range(200), atol=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_the_last_measurement_stands_in_for_lost_ones(offset):
    numbers = used(LossyMeasurement(1, PERIOD, loss=0.5, offset=offset, seed=3), offset=offset)
    arrived = [n for n in range(200) if abs(numbers[n] - n) < 1e-6]
    assert 70 < len(arrived) < 130
    first = arrived[0]
    expected = [max(n for n in arrived if n <= period) for period in range(first, 200)]
    np.testing.assert_allclose(numbers[first:], expected, atol=1e-6)


@pytest.mark.parametrize("late_by", [0.0, 0.1, 0.25])
def test_late_ones_are_used_when_they_arrive_unless_a_newer_one_has(late_by):
    periods = {0.0: 1, 0.1: 1, 0.25: 3}[late_by]
    numbers = used(LossyMeasurement(1, PERIOD, late=0.7, late_by=late_by, seed=5))
    on_time = [n for n in range(200) if abs(numbers[n] - n) < 1e-6]
    assert 35 < len(on_time) < 90
    for period in range(10, 200):
        arrived = [n for n in range(period + 1) if n in on_time or n + periods <= period]
        assert numbers[period] == pytest.approx(max(arrived))


def test_all_late_is_a_delay():
    numbers = used(LossyMeasurement(1, PERIOD, late=1.0, late_by=0.2))
    np.testing.assert_allclose(numbers[2:], range(198), atol=1e-9)


def test_nothing_new_arrives_when_all_is_lost_and_its_state_at_rest_is_used():
    sensor = LossyMeasurement(2, PERIOD, loss=1.0)
    assert evaluate(sensor, {"measured": [4.0, 5.0]}, "received").tolist() == [0.0, 0.0]
    context = sensor.CreateDefaultContext()
    context.SetDiscreteState(sensor.state_at_rest(np.array([1.0, 2.0])))
    assert sensor.get_output_port().Eval(context).tolist() == [1.0, 2.0]


def test_a_seed_decides_what_is_lost():
    first, again, other = (used(LossyMeasurement(1, PERIOD, loss=0.5, seed=seed), 50) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"period": 0.0}, "positive period"),
        ({"late_by": -1.0}, "no negative delay"),
        ({"loss": 1.5}, "probabilities"),
        ({"late": -0.5}, "probabilities"),
    ],
)
def test_wrong_arguments_are_refused(wrong, complaint):
    with pytest.raises(ValueError, match=complaint):
        LossyMeasurement(1, **{"period": PERIOD, **wrong})
