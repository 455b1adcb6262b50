import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.laws.measurements import predict, wanted_accelerations
from coop_drake.plant import build_robot_plant, robot_chain
from coop_drake.systems import StatePredictor
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import context_with

PERIOD = 0.01
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
    block = StatePredictor(robot, LOAD, 2, PERIOD)
    simulator = Simulator(block, context_with(block, INPUTS))
    state, pose = np.array(INPUTS["robot_state"]), np.array(INPUTS["object_pose"])
    rows, chain = np.zeros((2, 7)), robot_chain(robot)
    for update in range(5):
        simulator.AdvanceTo((update + 0.5) * PERIOD)
        predicted, predicted_pose, now = np.empty(8), np.empty(3), np.empty(7)
        predict(chain, LOAD[:2], state, pose, rows, PERIOD, predicted, predicted_pose)
        linear, axes = np.array([1.5, -0.5]), np.array([0.7, -0.9])
        wanted_accelerations(chain, LOAD, predicted, predicted_pose, linear, axes, now)
        rows = np.vstack([rows[1:], now])
        predict(chain, LOAD[:2], state, pose, rows, PERIOD, predicted, predicted_pose)
        context = simulator.get_context()
        np.testing.assert_array_equal(block.GetOutputPort("predicted_state").Eval(context), predicted)
        np.testing.assert_array_equal(block.GetOutputPort("predicted_pose").Eval(context), predicted_pose)


@pytest.mark.parametrize("wrong", [(0, PERIOD), (2, 0.0)])
def test_no_delay_and_no_period_are_refused(robot, wrong):
    with pytest.raises(ValueError, match="a delay of one period or more"):
        StatePredictor(robot, LOAD, *wrong)
