"""How turning the object and robots that disagree move the axes, against Drake's mass matrix."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import DiagramBuilder
from scipy.linalg import expm

from coop_drake.laws import Funnel, ScheduledGains, transition_gains
from coop_drake.laws.axis_table import axis_table, bounds_of, track_row
from coop_drake.laws.couplings import disagreement_coupling, rate_terms
from coop_drake.plant import build_team_plant, turning_coupling
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.facts import bodies_of_team, joint_inertias, largest_disagreement, moved_bodies
from coop_drake.plant.parsing import bodies_of
from coop_drake.plant.team import set_configuration
from coop_drake.scenario import load_scenario
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team

PERIOD, LAG, WIDTH = 0.005, 0.005, 0.06

LONG_AFTER = 100.0  # bounds at rest [s]


def narrow_axis(age):
    """An axis whose funnel is its goal interval."""
    lower, upper = np.zeros(2), np.array([1.0, WIDTH])
    intervals = {"slice_lower": lower, "slice_upper": upper, "goal_lower": lower, "goal_upper": upper}
    gains = transition_gains(ScheduledGains(command_age=age), clearance=0.2, resting=0.5 * upper, **intervals)
    return axis_table(Funnel(**intervals, decay_rate=gains.decay_rate, shape=gains.funnel), gains)[1], gains


def sampled_radius(row, s, delay, mass_error):
    """Spectral radius of the linearised loop: samples, delay, hold, lag; (x, x', x'' and older samples)."""
    x, h = WIDTH / (1.0 + np.exp(-s)), 1e-6 * WIDTH
    ends = np.array([(x + h, 0.0), (x - h, 0.0), (x, h), (x, -h)])
    laws = [track_row(row, LONG_AFTER, *end)[0] for end in ends]
    stiffness, damping = (laws[1] - laws[0]) / (2.0 * h), (laws[3] - laws[2]) / (2.0 * h)
    old = round(delay / PERIOD)
    plant = np.zeros((4, 4))
    plant[0, 1] = plant[1, 2] = 1.0
    plant[2, 2:] = -1.0 / LAG, 1.0 / LAG
    step = expm(PERIOD * plant)
    loop = np.zeros((3 + 2 * old, 3 + 2 * old))
    loop[:3, :3] = step[:3, :3]
    loop[3:5, :2] = np.eye(2)
    loop[5:, 3:-2] = np.eye(2 * old - 2)
    loop[:3, -2:] -= (1.0 + mass_error) * np.outer(step[:3, 3], [stiffness, damping])
    return np.abs(np.linalg.eigvals(loop)).max()


@pytest.mark.parametrize("delay", [0.01, 0.02])
@pytest.mark.parametrize("mass_error", [-0.2, 0.0, 0.2])
def test_a_late_joint_is_stable_up_to_a_sixth_of_its_width_before_a_bound(delay, mass_error):
    row, gains = narrow_axis(delay + 0.5 * PERIOD + LAG)
    radii = [sampled_radius(row, s, delay, mass_error) for s in np.linspace(0.0, 1.6, 9)]
    assert max(radii) < 1.0
    assert sampled_radius(row, 1.8, delay, mass_error) > 1.0
    assert sampled_radius(row, np.log(49.0) - 1e-3, delay, mass_error) > 1.3
    pull = -track_row(row, LONG_AFTER, WIDTH / (1.0 + np.exp(-1.6)), 0.0)[0]
    assert pull == pytest.approx(0.31 * gains.rate_gain**2 * WIDTH, rel=0.02)


def turned(name, *configurations):
    """Accelerations of the joints that turn with the object at 1 rad/s, where nothing is commanded."""
    team = build_team_plant(load_scenario(name), DiagramBuilder())
    plant, found = team.plant, []
    context, rates = plant.CreateDefaultContext(), np.zeros(plant.num_velocities())
    rates[team.velocity_index[2]] = 1.0
    for joints in configurations:
        set_configuration(team, context, np.array([0.0, 0.0, 0.0, *joints]))
        plant.SetVelocities(context, rates)
        free = -np.linalg.solve(plant.CalcMassMatrix(context), plant.CalcBiasTerm(context))
        found.append(free[team.velocity_index[3:]])
    return np.array(found)


@pytest.mark.parametrize(("name", "coupling"), [("base", 3.94), ("elbow", 12.78)])
def test_the_coupling_of_a_team_is_the_largest_over_its_configurations(name, coupling):
    team = build_team_plant(load_scenario(name), DiagramBuilder())
    found = turning_coupling(team)
    assert found == pytest.approx(coupling, abs=0.01)
    joints = np.random.default_rng(1).uniform(-1.8, 1.8, (200, len(team.velocity_index) - 3))
    assert 0.9 * found < np.abs(turned(name, *joints)).max() < 1.05 * found


def test_the_coefficients_of_rate_terms_are_those_of_the_models(tmp_path):
    arms = [(REVOLUTE, PRISMATIC), (PRISMATIC, REVOLUTE), (REVOLUTE, REVOLUTE)]
    team = build_team_plant(ring_team(tmp_path, arms), DiagramBuilder())
    tree, plant = read_component_tree(team), team.plant
    joints = np.random.default_rng(4).uniform(0.6 * tree.joint_lower, 0.6 * tree.joint_upper, (3, 6))
    found = rate_terms(tree, bodies_of_team(team, tree), joint_inertias(team).tolist(), joints)
    context, unit = plant.CreateDefaultContext(), np.eye(7)

    def free(*axes):
        rates = np.zeros(plant.num_velocities())
        rates[team.velocity_index[2:]] = sum(unit[axis] for axis in axes)
        plant.SetVelocities(context, rates)
        return -np.linalg.solve(plant.CalcMassMatrix(context), plant.CalcBiasTerm(context))[
            team.velocity_index[2:]
        ]

    for configuration, coefficients in zip(joints, found, strict=True):
        set_configuration(team, context, np.array([0.0, 0.0, 0.7, *configuration]))
        for j in range(7):
            np.testing.assert_allclose(coefficients[:, j, j], np.abs(free(j)), atol=1e-9)
            for k in range(j):
                both = np.abs(free(j, k) - free(j) - free(k))
                np.testing.assert_allclose(coefficients[:, j, k], both, atol=1e-9)


@pytest.mark.parametrize("age", [0.015, 0.0275])
def test_the_angle_turns_as_fast_as_the_narrowest_joint_bears(age):
    rule = ScheduledGains(command_age=age)
    lower, upper = np.array([0.0, 0.0, 0.0]), np.array([1.0, 0.5, 0.5])
    goal_lower = np.array([0.8, 0.44, 0.1])
    gains = transition_gains(
        rule, clearance=0.2, slice_lower=lower, slice_upper=upper, goal_lower=goal_lower, goal_upper=upper,
        resting=np.array([0.1, 0.4, 0.2]),
    )  # fmt: skip
    funnel = Funnel(lower, upper, goal_lower, upper, gains.decay_rate)
    times = np.linspace(0.0, 5.0 / gains.decay_rate[0], 2001)
    rows = axis_table(funnel, gains)
    fastest = max(bounds_of(rows[0], time)[2] for time in times)
    bearable = rule.turning_acceleration * gains.rate_gain**2 * 0.06
    assert rule.turning_coupling * fastest**2 == pytest.approx(bearable, rel=1e-4)


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
