"""The team as a planar tree against Drake's own plant."""

import numpy as np
import pytest
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.robot_dynamics import DAMPING
from coop_drake.laws.team_dynamics import (
    BRAKING_TIME,
    STICKING_TIME,
    solve_tree,
    stick,
    sticking_room,
    team_accelerations,
    team_work,
)
from coop_drake.plant import build_team_plant, read_component_tree, read_team_tree
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team

ARMS = [[REVOLUTE, PRISMATIC, REVOLUTE], [PRISMATIC], [REVOLUTE, REVOLUTE], []]
GRAVITY = 0.3


def applied(team, wrenches):
    """Wrenches on the bases and on the object as Drake takes them."""
    forces = []
    origins = [(robot.base_body, np.zeros(3)) for robot in team.robots]
    origins.append((team.object_body, team.object_frame.GetFixedPoseInBodyFrame().translation()))
    for (body, place), (fx, fy, torque) in zip(origins, wrenches, strict=True):
        force = ExternallyAppliedSpatialForce()
        force.body_index, force.p_BoBq_B = body.index(), place
        force.F_Bq_W = SpatialForce(tau=[0.0, 0.0, torque], f=[fx, fy, 0.0])
        forces.append(force)
    return forces


def test_the_team_accelerates_as_in_drake(tmp_path):
    builder, generator = DiagramBuilder(), np.random.default_rng(1)
    team = build_team_plant(ring_team(tmp_path, ARMS), builder)
    plant, diagram = team.plant, builder.Build()
    plant.mutable_gravity_field().set_gravity_vector([GRAVITY, 0.0, 0.0])
    tree = read_team_tree(team, read_component_tree(team))
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    tree.tree[1:, DAMPING] = 0.7
    for joint in team.joints:
        joint.SetDampingVector(context, [0.7])
    size, work = plant.num_velocities(), team_work(tree.tree)
    for _ in range(20):
        state, wrenches = generator.normal(size=2 * size), generator.normal(size=(len(ARMS) + 1, 3))
        state[team.position_index[3:]] *= 0.1  # nothing touches, and no joint is at its limit
        torques, efforts = generator.normal(size=len(team.joints)), np.zeros(size)
        efforts[team.velocity_index[3:]] = torques
        plant.SetPositionsAndVelocities(context, state)
        plant.get_actuation_input_port().FixValue(context, torques)
        plant.get_applied_spatial_force_input_port().FixValue(context, applied(team, wrenches))
        expected = plant.get_generalized_acceleration_output_port().Eval(context)
        found = np.empty(size)
        forces = tree.bases, tree.places, wrenches, efforts, GRAVITY
        team_accelerations(tree.tree, *forces, state, work, found)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("friction", [(0.0, 0.0), (2.0, 0.3), (20.0, 0.0)])
@pytest.mark.parametrize("blocked", [[], [0], [1, 2], [0, 1, 2, 3]])
def test_what_sticks_in_drake_sticks_whatever_else_acts(tmp_path, blocked, friction):
    """Bases with blocked wheels are braked, joints as far as their friction suffices.

    Also where so many bases are blocked that the floor's wrenches are not unique.
    """
    builder, generator = DiagramBuilder(), np.random.default_rng(2)
    team = build_team_plant(ring_team(tmp_path, ARMS), builder)
    plant, diagram = team.plant, builder.Build()
    tree = read_team_tree(team, read_component_tree(team))
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    size, work, room = plant.num_velocities(), team_work(tree.tree), sticking_room(len(tree.tree), len(ARMS))
    flags, joints = np.zeros(len(ARMS)), team.velocity_index[3:]
    loose = [len(blocked) < 2 or k not in blocked for k, arm in enumerate(ARMS) for _ in arm]
    kinds = set()
    flags[blocked] = 1.0
    for draw in range(10):
        state, wrenches = generator.normal(size=2 * size), 30.0 * generator.normal(size=(len(ARMS) + 1, 3))
        state[team.position_index[3:]] *= 0.1
        # Where all are blocked, no motion of the team brakes all of them alike while it turns.
        state[size:] *= 0.0 if len(blocked) == len(ARMS) or draw % 2 else 1.0
        torques, efforts = 3.0 * generator.normal(size=len(team.joints)), np.zeros(size)
        efforts[joints] = torques
        found, asked = np.empty(size), wrenches.copy()
        forces = tree.bases, tree.places, flags, np.array(friction), efforts, 0.0
        stick(tree.tree, *forces, state, work, room, found, wrenches)
        free = [k for k in range(len(ARMS) + 1) if k not in blocked]
        np.testing.assert_array_equal(wrenches[free], asked[free])
        plant.SetPositionsAndVelocities(context, state)
        plant.get_actuation_input_port().FixValue(context, efforts[joints])
        plant.get_applied_spatial_force_input_port().FixValue(context, applied(team, wrenches))
        accelerated = plant.get_generalized_acceleration_output_port().Eval(context)
        np.testing.assert_allclose(found, accelerated, rtol=1e-9, atol=1e-7)
        for robot in (team.robots[k] for k in blocked):
            moving = robot.base_body.EvalSpatialVelocityInWorld(context)
            braked = robot.base_body.EvalSpatialAccelerationInWorld(context)
            expected = -np.array([*moving.translational()[:2], moving.rotational()[2]]) / BRAKING_TIME
            seen = [*braked.translational()[:2], braked.rotational()[2]]
            np.testing.assert_allclose(seen, expected, rtol=1e-6, atol=1e-6)
        rates = state[size + joints]
        dry = efforts[joints] - torques + friction[1] * rates
        assert (np.abs(dry) <= (1.0 + 1e-8) * friction[0] + 1e-12).all()
        beyond = accelerated[joints] + rates / STICKING_TIME
        for force, rate, fast in zip(dry[loose], rates[loose], beyond[loose], strict=True):
            kind = "sticks" if abs(fast) < 1e-6 else "slides"
            if kind == "slides":
                assert force == pytest.approx(-np.sign(fast) * friction[0])
            kinds.add((kind, rate == 0.0))
    assert len(kinds) == (4 if friction[0] else 2) * any(loose), kinds


@pytest.mark.parametrize("parents", [[-1], [-1, 0], [-1, 0, 1, 2, 3, 2, 5], [-1, 0, 0, 1, 1, 3]])
def test_positive_definite_systems_of_trees_are_solved(parents):
    generator, size = np.random.default_rng(len(parents)), len(parents)
    lower, right = np.diag(generator.uniform(0.5, 2.0, size)), generator.normal(size=size)
    for k in range(size):
        i = parents[k]
        while i >= 0:
            lower[k, i], i = generator.normal(), parents[i]
    matrix, solution = lower.T @ lower, right.copy()
    read = np.where(np.tril(matrix) == 0.0, np.nan, np.tril(matrix))  # What is zero is not read.
    solve_tree(np.array(parents), read, solution)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-9)
