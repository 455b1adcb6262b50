"""How robots that command different accelerations move the axes, against Drake's mass matrix."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.couplings import disagreement_coupling
from coop_drake.plant import build_team_plant
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.facts import bodies_of_team, joint_inertias, largest_disagreement, moved_bodies
from coop_drake.plant.parsing import bodies_of
from coop_drake.plant.team import set_configuration
from coop_drake.scenario import load_scenario
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    arms = [(REVOLUTE, PRISMATIC), (REVOLUTE,), (REVOLUTE, REVOLUTE)]
    scenario = ring_team(tmp_path_factory.mktemp("ring"), arms)
    team = build_team_plant(scenario, DiagramBuilder())
    tree = read_component_tree(team)
    draw = np.random.default_rng(3)
    joints = draw.uniform(0.6 * tree.joint_lower, 0.6 * tree.joint_upper, (4, len(tree.joints)))
    return scenario, team, tree, joints


def test_the_coupling_is_that_of_the_models(ring):
    scenario, team, tree, joints = ring
    rotors = joint_inertias(team).tolist()
    found = disagreement_coupling(tree, moved_bodies(scenario, team), rotors, joints)
    plant, world = team.plant, team.plant.world_frame()
    context = plant.CreateDefaultContext()

    def push(bodies, share):
        """The generalised force of a body's mass in the directions x and y of W."""
        total = np.zeros((plant.num_velocities(), 2))
        for body in bodies:
            centre = body.CalcCenterOfMassInBodyFrame(context)
            jacobian = plant.CalcJacobianTranslationalVelocity(
                context, JacobianWrtVariable.kV, body.body_frame(), centre, world, world
            )
            total += share * body.get_mass(context) * jacobian[:2].T
        return total

    load = bodies_of(plant, [team.assembly.object_model])
    shares = [scenario.load_share(robot.name, len(team.robots)) for robot in team.robots]
    owned = [bodies_of(plant, robot.models) for robot in team.assembly.robots]
    for configuration, coupling in zip(joints, found, strict=True):
        set_configuration(team, context, np.array([0.0, 0.0, 0.3, *configuration]))
        mass = plant.CalcMassMatrix(context)
        pushes = [push(own, 1.0) + push(load, share) for own, share in zip(owned, shares, strict=True)]
        moved = np.array([np.linalg.solve(mass, one)[team.velocity_index[2:]] for one in pushes])
        np.testing.assert_allclose(coupling, np.sqrt((moved**2).sum(axis=(0, 2))), rtol=1e-9)
        np.testing.assert_allclose(moved.sum(axis=0), 0.0, atol=1e-9)  # where all robots command the same


def test_one_robot_that_moves_all_has_nobody_to_disagree_with(ring):
    _, team, tree, joints = ring
    alone = tuple((*body, 0.0) for body in bodies_of_team(team, tree))
    found = disagreement_coupling(tree, alone, joint_inertias(team).tolist(), joints)
    np.testing.assert_allclose(found, 0.0, atol=1e-9)


def test_light_arms_of_two_joints_bear_the_least_disagreement():
    coupling = {}
    for name in ("base", "elbow"):
        scenario = load_scenario(name)
        coupling[name] = largest_disagreement(scenario, build_team_plant(scenario, DiagramBuilder()))
    assert coupling["base"] == pytest.approx(2.73, abs=0.02)
    assert coupling["elbow"] > 3.0 * coupling["base"]


def test_a_robot_that_carries_no_share_of_the_load_still_moves_itself():
    scenario = load_scenario("base")
    shared = replace(scenario, load_shares={"robot_0": 0.0, "robot_1": 1.0})
    team = build_team_plant(shared, DiagramBuilder())
    moved = moved_bodies(shared, team)
    assert all(body[1] > 0.0 for body in moved)  # Two bodies without mass have no common centre of mass.
    assert [sum(body[1] for body in moved if body[5] == k) for k in (0, 1)] == pytest.approx([8.0, 9.0])
    assert sum(body[1] for body in moved) == pytest.approx(
        sum(body[1] for body in bodies_of_team(team, read_component_tree(team)))
    )
    assert 0.0 < largest_disagreement(shared, team) < np.inf
