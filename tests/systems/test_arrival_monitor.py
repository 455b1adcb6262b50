import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.laws.readiness import FAR, ArrivalGoal, arrival_margin, mean_samples
from coop_drake.systems import ArrivalMonitor
from tests.support.system_checks import context_with, evaluate

PERIOD, CELLS = 0.01, 3
GOAL = ArrivalGoal(np.array([3.0, 2.0, 0.5, 0.1]), np.array([0.01, 0.02, np.inf]), np.zeros(3))
INPUTS = {
    "robot_state": [9.0, 9.0, 9.0, 0.1, 1.0, 2.0, 3.0, 4.0],
    "object_pose": [3.001, 2.0, 0.5],
    "current_cell": [CELLS - 1.0, 0.0],
}


@pytest.fixture
def monitor():
    return ArrivalMonitor(GOAL, CELLS, PERIOD)


def test_it_has_not_measured_enough_at_first_and_compares_means_in_the_last_cell_alone(monitor):
    simulator = Simulator(monitor, context_with(monitor, INPUTS))
    context, rows = simulator.get_mutable_context(), 2 * mean_samples(PERIOD)
    samples = np.array([[3.001, 2.0, 0.5, 0.1]] * rows)
    samples[:, 0] += 1e-4 * np.sin(np.arange(rows))
    for k, sample in enumerate(samples):
        monitor.GetInputPort("object_pose").FixValue(context, sample[:3])
        assert evaluate_now(monitor, context) == FAR, k
        simulator.AdvanceTo(PERIOD * k + 0.5 * PERIOD)
    expected = arrival_margin(*GOAL, samples, rows - 1)
    assert 0.0 < expected < 1.0
    assert evaluate_now(monitor, context) == pytest.approx(expected)
    monitor.GetInputPort("current_cell").FixValue(context, [0.0, 0.0])
    kept = context.get_discrete_state_vector().value().copy()
    simulator.AdvanceTo(PERIOD * (rows + 3))
    assert evaluate_now(monitor, context) == FAR
    np.testing.assert_array_equal(context.get_discrete_state_vector().value(), kept)


def evaluate_now(monitor, context):
    return float(monitor.GetOutputPort("arrival").Eval(context)[0])


def test_before_the_last_cell_nothing_has_arrived(monitor):
    assert evaluate(monitor, {**INPUTS, "current_cell": [0.0, 0.0]}, "arrival").tolist() == [FAR]
