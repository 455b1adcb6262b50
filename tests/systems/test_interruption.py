import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.systems import Interruption
from tests.support.system_checks import evaluate

PERIOD = 0.1


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
    block = Interruption(2, PERIOD, begin=1.0, duration=0.5, held=held)
    found = given(block, [0.55, 1.0, 1.25, 1.45, 1.5, 1.75])
    expected = [[1.55, -0.55], during, during, during, [2.5, -1.5], [2.75, -1.75]]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_without_a_duration_it_never_comes_back():
    assert np.all(given(Interruption(2, PERIOD, begin=0.0, held=False), [0.0, 1.0, 9.0]) == 0.0)


@pytest.mark.parametrize("wrong", [{"period": 0.0}, {"duration": 0.0}])
def test_wrong_times_are_refused(wrong):
    with pytest.raises(ValueError, match="positive period and duration"):
        Interruption(1, **{"period": PERIOD, "begin": 1.0, **wrong})


def test_what_is_held_from_the_start_is_what_was_before():
    block = Interruption(2, 0.1, begin=0.0, held=True, before=-1.0)
    np.testing.assert_array_equal(evaluate(block, {"wanted": [3.0, 4.0]}, "given"), [-1.0, -1.0])
