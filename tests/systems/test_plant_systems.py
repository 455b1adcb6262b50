import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.plant import base_poses, build_robot_plant, build_team_plant, set_configuration
from coop_drake.systems import ObjectEstimator, RobotEffort, TeamSensor
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_matrices import robot_acceleration, robot_torque
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import (
    evaluate,
    port_sizes,
)

TEAMS = ("base", "elbow", "three")


class Rig:
    """A shipped team in a configuration where nothing is symmetric, moving."""

    def __init__(self, team):
        self.scenario = small_scenario(team)
        self.team = build_team_plant(self.scenario, DiagramBuilder())
        generator = np.random.default_rng(3)
        n = len(self.team.joints)
        self.z = np.array([3.0, 3.0, 0.4, *generator.uniform(-0.8, 0.8, n)])
        self.rates = generator.uniform(-0.5, 0.5, 3 + n)
        self.context = self.team.plant.CreateDefaultContext()
        set_configuration(self.team, self.context, self.z, self.rates)
        self.team_state = self.team.plant.GetPositionsAndVelocities(self.context)

    def measured(self):
        """The object's pose, then every robot's state."""
        sensor = TeamSensor(self.team)
        values = evaluate(sensor, {"team_state": self.team_state}, "measurements")
        return np.split(values, np.cumsum(sensor.sizes)[:-1])

    def robot_state(self, k):
        return self.measured()[1 + k]

    def grasp(self, k):
        X_LE = self.team.robots[k].X_LE
        return np.array([X_LE.x, X_LE.y])


@pytest.fixture(scope="module", params=TEAMS)
def rig(request):
    return Rig(request.param)


def test_the_team_sensor_reads_the_object_and_every_robots_base_and_joints(rig):
    sensor, states = TeamSensor(rig.team), rig.team.plant.num_multibody_states()
    sizes = [3, *(2 * (3 + len(robot.joints)) for robot in rig.team.robots)]
    assert sensor.sizes == sizes
    assert port_sizes(sensor) == ({"team_state": states}, {"measurements": sum(sizes)})
    pose, *robots = rig.measured()
    np.testing.assert_array_equal(pose, rig.z[:3])
    ahead, step = rig.team.plant.CreateDefaultContext(), 1e-6
    set_configuration(rig.team, ahead, rig.z + step * rig.rates)
    behind = rig.team.plant.CreateDefaultContext()
    set_configuration(rig.team, behind, rig.z - step * rig.rates)
    base_rates = (base_poses(rig.team, ahead) - base_poses(rig.team, behind)) / (2.0 * step)
    for robot, state in zip(rig.team.robots, robots, strict=True):
        n = len(robot.joints)
        np.testing.assert_allclose(state[:3], base_poses(rig.team, rig.context)[robot.index], atol=1e-14)
        np.testing.assert_array_equal(state[3 : 3 + n], rig.z[3:][robot.q_slice])
        np.testing.assert_allclose(state[3 + n : 6 + n], base_rates[robot.index], atol=1e-8)
        np.testing.assert_array_equal(state[6 + n :], rig.rates[3:][robot.q_slice])


def test_every_robot_finds_the_objects_state_from_its_own_motion(rig):
    for robot in rig.team.robots:
        k, n = robot.index, len(robot.joints)
        system = ObjectEstimator(build_robot_plant(rig.scenario, k), rig.grasp(k))
        assert port_sizes(system) == ({"robot_state": 2 * (3 + n), "object_pose": 3}, {"object_state": 6})
        inputs = {"robot_state": rig.robot_state(k), "object_pose": rig.z[:3]}
        known = evaluate(system, inputs, "object_state")
        np.testing.assert_array_equal(known[:3], rig.z[:3])
        np.testing.assert_allclose(known[3:], rig.rates[:3], atol=1e-13)


def test_the_effort_is_the_law_with_the_robots_own_dynamics(rig):
    generator = np.random.default_rng(5)
    for robot in rig.team.robots:
        k, n = robot.index, len(robot.joints)
        model = robot_dynamics(rig.scenario, k)
        system = RobotEffort(model)
        inputs = {
            "robot_state": rig.robot_state(k),
            "hand_command": generator.normal(size=6),
            "axis_acceleration": generator.normal(size=1 + n),
        }
        assert port_sizes(system) == (
            {name: len(value) for name, value in inputs.items()},
            {"robot_effort": 3 + n},
        )
        model.set_state(*np.split(inputs["robot_state"], 2))
        acceleration = robot_acceleration(
            inputs["hand_command"][:3],
            inputs["axis_acceleration"][1:],
            jacobian=model.grasp_jacobian(),
            jacobian_rate_term=model.grasp_bias(),
        )
        expected = robot_torque(
            acceleration,
            inputs["hand_command"][3:],
            mass_matrix=model.mass_matrix(),
            bias=model.bias(),
            jacobian=model.grasp_jacobian(),
        )
        np.testing.assert_allclose(evaluate(system, inputs, "robot_effort"), expected, rtol=1e-12, atol=1e-12)
