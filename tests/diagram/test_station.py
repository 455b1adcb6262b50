"""What robots ask of their actuators acts on the team's plant, wherever its bases point."""

import numpy as np
import pytest

from coop_drake.diagram import build_station
from coop_drake.plant import set_configuration
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import context_with


@pytest.fixture(scope="module", params=["base", "elbow", "three"])
def station(request):
    return build_station(small_scenario(request.param))


def efforts_of(team):
    generator = np.random.default_rng(7)
    return {
        f"robot_{robot.index}_effort": generator.normal(size=3 + len(robot.joints)) for robot in team.robots
    }


@pytest.fixture
def driven(station):
    """Efforts, and the plant's context in which they act on a team that stands askew."""
    team, efforts = station.team, efforts_of(station.team)
    root = context_with(station.diagram, efforts)
    z = np.array([3.0, 3.0, 0.4, *np.linspace(-0.8, 0.7, len(team.joints))])
    set_configuration(team, team.plant.GetMyMutableContextFromRoot(root), z)
    return efforts, root, team.plant.GetMyContextFromRoot(root)


def test_base_wrenches_act_on_bases_in_the_axes_of_the_world(station, driven):
    efforts, _root, context = driven
    forces = station.team.plant.get_applied_spatial_force_input_port().Eval(context)
    assert {force.body_index for force in forces} == {
        robot.base_body.index() for robot in station.team.robots
    }
    for robot, effort in zip(station.team.robots, efforts.values(), strict=True):
        on_base = [force for force in forces if force.body_index == robot.base_body.index()]
        for force in on_base:
            np.testing.assert_array_equal(force.p_BoBq_B, np.zeros(3))
        pushed = sum(force.F_Bq_W.translational() for force in on_base)
        turned = sum(force.F_Bq_W.rotational() for force in on_base)
        np.testing.assert_array_equal(pushed[:2], effort[:2])
        np.testing.assert_array_equal(turned, [0.0, 0.0, effort[2]])
        assert abs(pushed[2]) <= 1e-15 * np.abs(effort[:2]).sum()  # the floor holds what a right angle rounds


def test_joint_torques_act_on_joints(station, driven):
    efforts, _root, context = driven
    np.testing.assert_array_equal(
        station.team.plant.get_actuation_input_port().Eval(context),
        np.concatenate([effort[3:] for effort in efforts.values()]),
    )


def test_actuation_needs_every_robots_effort(station):
    efforts, plant = efforts_of(station.team), station.team.plant
    del efforts["robot_1_effort"]
    context = plant.GetMyContextFromRoot(context_with(station.diagram, efforts))
    for port in (plant.get_applied_spatial_force_input_port(), plant.get_actuation_input_port()):
        with pytest.raises(RuntimeError, match="robot_1_effort"):
            port.Eval(context)
