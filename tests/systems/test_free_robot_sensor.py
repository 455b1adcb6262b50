import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.plant import build_separate_team, build_team_plant, set_configuration
from coop_drake.systems import FreeRobotSensor, RobotStateSensor
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import assert_every_input_is_required, evaluate, port_sizes


@pytest.fixture(scope="module", params=["base", "elbow"])
def teams(request):
    """The same team in both plants, in the same configuration, and each plant's state."""
    scenario = small_scenario(request.param)
    built = [build(scenario, DiagramBuilder()) for build in (build_separate_team, build_team_plant)]
    rng = np.random.default_rng(3)
    z, rates = rng.uniform(-0.7, 0.7, (2, 3 + len(built[0].joints)))
    states = []
    for team in built:
        context = team.plant.CreateDefaultContext()
        set_configuration(team, context, z, rates)
        states.append(team.plant.GetPositionsAndVelocities(context))
    return list(zip(built, states, strict=True))


def test_a_robot_measures_the_same_in_both_plants(teams):
    (separate, state), (tree, tree_state) = teams
    for robot in separate.robots:
        sensor, n = FreeRobotSensor(separate, robot.index), len(robot.joints)
        states = separate.plant.num_multibody_states()
        assert port_sizes(sensor) == ({"team_state": states}, {"robot_state": 2 * (3 + n)})
        measured = evaluate(sensor, {"team_state": state}, "robot_state")
        expected = evaluate(RobotStateSensor(tree, robot.index), {"team_state": tree_state}, "robot_state")
        np.testing.assert_allclose(measured, expected, atol=1e-12)


def test_the_state_is_required(teams):
    (separate, state), _ = teams
    sensor = FreeRobotSensor(separate, 0)
    assert_every_input_is_required(sensor, {"team_state": state}, {"robot_state": {"team_state"}})


def test_a_robot_that_is_not_there_is_refused(teams):
    (separate, _), _ = teams
    with pytest.raises(IndexError, match="robot 2 is not in the team of 2"):
        FreeRobotSensor(separate, 2)
