"""The team's plant, each robot's own model of itself, and the compiled chains and tree, against Drake."""

import numpy as np
import pytest
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.robot_dynamics import DAMPING, estimate_object, motion_room, read_robot, robot_effort
from coop_drake.laws.team_dynamics import (
    BRAKING_TIME,
    STICKING_TIME,
    solve_tree,
    stick,
    sticking_room,
    team_accelerations,
    team_work,
)
from coop_drake.plant import (
    base_chain,
    base_poses,
    build_team_plant,
    read_component_tree,
    read_team_tree,
    robot_chain,
    set_configuration,
)
from coop_drake.scenario import load_scenario
from coop_drake.systems import RobotEffort
from coop_drake.tree.component_tree import PlanarPose
from tests.support.cases import GRASPS
from tests.support.configuration import get_configuration, get_rates
from tests.support.edited_scenario import MODELS, exchanged, shipped, team_of, write_edited, write_with_robot
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_matrices import robot_acceleration
from tests.support.robot_models import Arm
from tests.support.system_checks import evaluate


def test_grasps_bases_and_masses_of_shipped_teams_by_hand():
    """Grasps are where the object offers them; straight arms put the bases in line."""
    three, _builder = team_of(shipped("three"))
    for robot, grasp in zip(three.robots, GRASPS, strict=False):
        assert (robot.X_LE.x, robot.X_LE.y) == pytest.approx((grasp.x, grasp.y))
        assert np.cos(robot.X_LE.angle - grasp.angle) == pytest.approx(1.0)
    inertia, context = three.object_inertia, three.plant.CreateDefaultContext()
    assert (inertia.mass, inertia.inertia_about_com) == pytest.approx((1.0, 1.0))
    assert inertia.p_LLcm == pytest.approx([0.0, 0.0])
    for robot in three.robots:
        bodies = [
            three.plant.get_body(i) for i in three.plant.GetBodyIndices(robot.base_body.model_instance())
        ]
        masses = {body.name(): body.get_mass(context) for body in bodies}
        assert masses == pytest.approx({"base": 6.0, "link_1": 1.0, "link_2": 1.0})
    team, _builder = team_of(shipped("base"))
    context = team.plant.CreateDefaultContext()
    set_configuration(team, context, np.zeros(5))
    (x_0, y_0, yaw_0), (x_1, y_1, yaw_1) = base_poses(team, context)
    assert (x_0, y_0, abs(yaw_0)) == pytest.approx((1.15, 0.0, np.pi), abs=1e-12)
    assert (x_1, y_1, yaw_1) == pytest.approx((-1.15, 0.0, 0.0), abs=1e-12)


def test_inertia_of_an_object_whose_mass_lies_off_its_frame(tmp_path):
    text = exchanged(
        (MODELS / "object.sdf").read_text(), ("<pose>0 0 0 0 0 0</pose>", "<pose>0.1 -0.05 0 0 0 0</pose>")
    )
    path = write_edited(tmp_path, ("package://coop_drake_models/object.sdf", "heavy.sdf"), heavy_sdf=text)
    team, _builder = team_of(load_scenario(path))
    assert team.object_inertia.p_LLcm == pytest.approx([0.1, -0.05])
    assert team.object_inertia.inertia_about_com == pytest.approx(1.0)


def test_weld_offset_moves_the_grasp(tmp_path):
    weld = "{parent: object::grasp_0, child: robot_0::gripper"
    turned = "{parent: robot_0::gripper, child: object::grasp_0"
    offset = ", X_PC: {translation: [0.02, 0.05, 0], rotation: !Rpy {deg: [0, 0, 10]}}}"
    team, _one = team_of(load_scenario(write_edited(tmp_path, (weld + "}", weld + offset))))
    expected = PlanarPose(0.42, 0.05, np.deg2rad(10.0))
    found = team.robots[0].X_LE
    assert (found.x, found.y, found.angle) == pytest.approx((expected.x, expected.y, expected.angle))
    other, _two = team_of(load_scenario(write_edited(tmp_path, (weld + "}", turned + offset))))
    back = PlanarPose(0.4) @ PlanarPose(0.02, 0.05, np.deg2rad(10.0)).inverse()
    found = other.robots[0].X_LE
    assert (found.x, found.y, found.angle) == pytest.approx((back.x, back.y, back.angle))


def test_efforts_and_rotors_that_a_file_states_are_kept(tmp_path):
    limits = "<limit><lower>-1</lower><upper>1</upper><effort>{}</effort></limit>"
    for stated, kept in (("3", 3.0), ("0", np.inf)):
        arm = Arm(joints=(("revolute", "0 0 1", limits.format(stated)),)).text()
        team, _builder = team_of(load_scenario(write_with_robot(tmp_path, arm)))
        actuators = [team.plant.get_joint_actuator(i) for i in team.plant.GetJointActuatorIndices()]
        assert [actuator.effort_limit() for actuator in actuators] == [kept, np.inf]


def test_the_plant_has_the_coordinates_of_the_object_and_the_joints_and_torques_in_their_order(team):
    size = 3 + len(team.joints)
    assert team.plant.num_positions() == size
    assert sorted(team.position_index) == sorted(team.velocity_index) == list(range(size))
    assert team.plant.time_step() == 0.0
    assert team.plant.gravity_field().gravity_vector() == pytest.approx([0.0, 0.0, 0.0])
    actuation = team.plant.MakeActuationMatrix()[team.velocity_index]
    assert actuation == pytest.approx(np.eye(size)[:, 3:])
    context, generator = team.plant.CreateDefaultContext(), np.random.default_rng(5)
    z, z_rate = generator.uniform(-0.2, 0.2, size), generator.uniform(-1.0, 1.0, size)
    set_configuration(team, context, z, z_rate)
    assert get_configuration(team, context) == pytest.approx(z)
    assert get_rates(team, context) == pytest.approx(z_rate)
    X_WL = team.object_frame.CalcPoseInWorld(context)
    assert X_WL.translation() == pytest.approx([*z[:2], 0.0])
    assert X_WL.rotation().ToRollPitchYaw().vector() == pytest.approx([0.0, 0.0, z[2]])
    set_configuration(team, context, z)
    assert get_rates(team, context) == pytest.approx(np.zeros(size))


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


CHAINS = [[REVOLUTE, PRISMATIC, REVOLUTE], [PRISMATIC], [REVOLUTE, REVOLUTE]]


@pytest.mark.parametrize("k", range(len(CHAINS)))
def test_an_end_effector_moves_and_is_moved_as_in_drake(ring, k):
    robot, n = robot_dynamics(ring, k), len(CHAINS[k])
    robot.scale_masses(1.3)
    for joint in robot.joints:
        joint.SetDampingVector(robot.context, [0.7])
    robot.plant.get_joint_actuator(robot.plant.GetJointActuatorIndices()[0]).SetRotorInertia(
        robot.context, 0.4
    )
    chain, generator = robot_chain(robot), np.random.default_rng(k)
    for state, hand, joints in zip(
        generator.normal(size=(20, 2 * (3 + n))),
        generator.normal(size=(20, 6)),
        generator.normal(size=(20, n)),
        strict=True,
    ):
        robot.set_state(*np.split(state, 2))
        jacobian = robot.grasp_jacobian()
        seen, motion = np.empty(6), motion_room(chain)
        estimate_object(chain, np.zeros(2), motion, state, np.zeros(3), seen)
        np.testing.assert_allclose(seen[3:], jacobian @ state[3 + n :], atol=1e-14)
        acceleration = robot_acceleration(
            hand[:3], joints, jacobian=jacobian, jacobian_rate_term=robot.grasp_bias()
        )
        expected = robot.inertial_effort(acceleration) + hand[3:] @ jacobian
        effort = np.empty(3 + n)
        robot_effort(chain, motion, state, hand, np.array([9.0, *joints]), effort)
        np.testing.assert_allclose(effort, expected, atol=1e-13 * np.abs(expected).max())


def test_a_base_is_where_the_teams_plant_has_it(ring):
    team = build_team_plant(ring, DiagramBuilder())
    context, generator = team.plant.CreateDefaultContext(), np.random.default_rng(1)
    for robot in team.robots:
        way, n = base_chain(team, robot), len(robot.joints)
        for state in generator.normal(size=(20, team.plant.num_multibody_states())):
            team.plant.SetPositionsAndVelocities(context, state)
            X_WB = robot.base_body.EvalPoseInWorld(context).GetAsMatrix34()
            V_WB = robot.base_body.EvalSpatialVelocityInWorld(context).get_coeffs()
            found = np.empty(2 * (3 + n))
            read_robot(way.chain, way.yaw, way.joints, motion_room(way.chain), state, found)
            expected = [X_WB[0, 3], X_WB[1, 3], np.arctan2(X_WB[1, 0], X_WB[0, 0])]
            np.testing.assert_allclose(found[:3], expected, atol=1e-14)
            np.testing.assert_allclose(found[3 + n : 6 + n], V_WB[[3, 4, 2]], atol=1e-14)


def test_springs_of_a_model_are_held(tmp_path):
    dynamics = (
        "<damping>0.3</damping><spring_stiffness>2</spring_stiffness><spring_reference>0.4</spring_reference>"
    )
    more = f"<limit><lower>-1</lower><upper>1</upper></limit><dynamics>{dynamics}</dynamics>"
    robot = robot_dynamics(ring_team(tmp_path, [[("revolute", "0 0 1", more)], [REVOLUTE]]), 0)
    assert robot.has_springs
    state, hand, joints = np.linspace(0.1, 0.8, 8), np.linspace(-1.0, 1.0, 6), np.array([0.5])
    inputs = {"robot_state": state, "hand_command": hand, "axis_acceleration": [9.0, *joints]}
    effort = evaluate(RobotEffort(robot), inputs, "robot_effort")
    robot.set_state(*np.split(state, 2))
    jacobian = robot.grasp_jacobian()
    z = robot_acceleration(hand[:3], joints, jacobian=jacobian, jacobian_rate_term=robot.grasp_bias())
    expected = robot.inertial_effort(z) + hand[3:] @ jacobian
    np.testing.assert_allclose(effort, expected, atol=1e-13)
    without = np.empty(4)
    chain = robot_chain(robot)
    robot_effort(chain, motion_room(chain), state, hand, np.array([9.0, *joints]), without)
    assert effort[3] - without[3] == pytest.approx(2.0 * (state[3] - 0.4))


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return ring_team(tmp_path_factory.mktemp("ring"), CHAINS)


ARMS = [[REVOLUTE, PRISMATIC, REVOLUTE], [PRISMATIC], [REVOLUTE, REVOLUTE], []]

GRAVITY = 0.3


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
    times, joints = np.full((2, len(ARMS)), np.inf), team.velocity_index[3:]
    loose = [len(blocked) < 2 or k not in blocked for k, arm in enumerate(ARMS) for _ in arm]
    kinds = set()
    times[:, blocked] = [[0.0], [1.0]]
    for draw in range(10):
        state, wrenches = generator.normal(size=2 * size), 30.0 * generator.normal(size=(len(ARMS) + 1, 3))
        state[team.position_index[3:]] *= 0.1
        # Where all are blocked, no motion of the team brakes all of them alike while it turns.
        state[size:] *= 0.0 if len(blocked) == len(ARMS) or draw % 2 else 1.0
        torques, efforts = 3.0 * generator.normal(size=len(team.joints)), np.zeros(size)
        efforts[joints] = torques
        found, asked = np.empty(size), wrenches.copy()
        forces = tree.bases, tree.places, times, 0.5, np.array(friction), efforts, 0.0
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
