"""What a team's masses couple: bounds over all joints of a cell, against what Drake's models have there."""

from functools import cache

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder
from shapely import box

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.laws.couplings import disagreement_coupling, rate_terms
from coop_drake.laws.motion import place_on_axes
from coop_drake.laws.robot_dynamics import end_effector_command, motion_room, robot_effort
from coop_drake.plant import base_chain, build_robot_plant, build_team_plant, robot_chain
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.facts import base_frames, joint_inertias, moved_bodies
from coop_drake.robustness import couplings as coupling
from coop_drake.robustness.couplings import cell_couplings, cell_efforts
from coop_drake.scenario import load_scenario
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team

ARMS = [(REVOLUTE, PRISMATIC), (REVOLUTE,), (PRISMATIC, REVOLUTE)]


class Case:
    """A team with a budget that limits its efforts, and cells for its joints."""

    def __init__(self, scenario, half_width):
        self.scenario = scenario
        self.team = build_team_plant(scenario, DiagramBuilder())
        self.tree = read_component_tree(self.team)
        context = self.team.plant.CreateDefaultContext()
        self.budget = Budget(
            bodies=moved_bodies(scenario, self.team),
            bases=base_frames(self.team, self.tree),
            rotors=tuple(joint_inertias(self.team).tolist()),
            dampings=tuple(float(joint.GetDampingVector(context)[0]) for joint in self.team.joints),
            base_force=1.0,
            lag=0.005,
        )
        draw, n = np.random.default_rng(5), len(self.team.joints)
        middles = draw.uniform(0.4 * self.tree.joint_lower, 0.4 * self.tree.joint_upper, (3, n))
        middles = np.column_stack([draw.uniform(-1.0, 1.0, 3), middles])
        room = box(0.0, 0.0, 1.0, 1.0)
        self.cells = tuple(Cell(middle - half_width, middle + half_width, room) for middle in middles)

    def drawn(self, count):
        """Joints in every cell, more of them near the ends, shape (cells, count, n)."""
        lower, upper = (
            np.array([getattr(cell, side)[1:] for cell in self.cells]) for side in ("lower", "upper")
        )
        shares = np.random.default_rng(1).beta(0.4, 0.4, (len(lower), count, lower.shape[1]))
        return lower[:, None] + shares * (upper - lower)[:, None]


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return Case(ring_team(tmp_path_factory.mktemp("ring"), ARMS), 0.04)


@cache
def shipped(name):
    return Case(load_scenario(name), 0.04)


def sampled(case, count):
    """The largest coefficients of rates and of disagreement that are found in every cell."""
    joints = case.drawn(count)
    flat, axes = joints.reshape(-1, joints.shape[2]), 1 + joints.shape[2]
    rates = rate_terms(case.tree, case.budget.bodies, case.budget.rotors, flat)
    pushes = disagreement_coupling(case.tree, case.budget.bodies, case.budget.rotors, flat)
    return (
        rates.reshape(*joints.shape[:2], axes, axes, axes).max(axis=1),
        pushes.reshape(*joints.shape[:2], axes).max(axis=1),
    )


@pytest.mark.parametrize("name", ["base", "elbow"])
def test_bounds_are_at_most_a_quarter_larger_than_what_is_found(name):
    case = shipped(name)
    bounds, (rates, _) = cell_couplings(case.budget, case.tree, case.cells), sampled(case, 2000)
    largest = rates.max(axis=(2, 3), keepdims=True)
    assert (rates <= bounds.rates[:, 1:]).all()
    assert (bounds.rates[:, 1:] <= 1.25 * rates + 0.05 * largest).all()
    assert (bounds.rates[:, 1:].sum(axis=(2, 3)) <= 1.25 * rates.sum(axis=(2, 3))).all()


def test_bounds_hold_for_joints_of_all_kinds(ring):
    bounds, (rates, pushes) = cell_couplings(ring.budget, ring.tree, ring.cells), sampled(ring, 400)
    assert (rates <= bounds.rates[:, 1:]).all()
    assert (pushes <= np.sqrt((bounds.pushes[:, 1:] ** 2).sum(axis=(2, 3)))).all()


@pytest.mark.parametrize("name", ["base", "ring"])
def test_no_effort_of_the_control_law_is_larger_than_its_parts(name, ring):
    """Efforts as robots compute them, for random joints, accelerations and rates."""
    case = ring if name == "ring" else shipped(name)
    team, draw, n = case.team, np.random.default_rng(8), len(case.team.joints)
    bounds, largest = cell_efforts(case.budget, case.tree, case.cells), 0.0
    robots = [(build_robot_plant(case.scenario, robot.index), robot) for robot in team.robots]
    chains = [robot_chain(plant) for plant, _ in robots]
    for cell, joints in enumerate(case.drawn(30)):
        for q in joints:
            theta, wanted = draw.uniform(-3.0, 3.0), draw.normal(size=2)
            accelerations, rates = draw.normal(size=1 + n) * 3.0, draw.normal(size=1 + n)
            most = np.hypot(*wanted) * bounds.push[cell] + bounds.axes[cell] @ np.abs(accelerations)
            most += (bounds.rates[cell] @ np.abs(rates)) @ np.abs(rates) + bounds.damping @ np.abs(rates)
            for chain, (_, robot) in zip(chains, robots, strict=True):
                own = [0, *range(1 + robot.q_slice.start, 1 + robot.q_slice.stop)]
                state, size = np.zeros(2 * (2 + len(own))), len(robot.joints)
                axes = np.array([[theta, *q], rates])[:, own]
                place_on_axes(axes, base_chain(team, robot).mounting, state)
                seen = np.array([0.0, 0.0, theta, 0.0, 0.0, rates[0]])
                command, effort = np.empty(6), np.empty(3 + size)
                load = RobotKnowledge.load.fget(_Load(case, robot))
                end_effector_command(load, seen, wanted, accelerations[own], command)
                robot_effort(chain, motion_room(chain), state, command, accelerations[own], effort)
                k, N = robot.index, len(robots)
                found = np.array([np.hypot(*effort[:2]), *np.abs(effort[2:])])
                allowed = most[[k, N + k, *range(2 * N + robot.q_slice.start, 2 * N + robot.q_slice.stop)]]
                assert (found <= allowed * (1.0 + 1e-9)).all()
                largest = max(largest, float((found / allowed).max()))
    assert largest > 0.7


class _Load:
    """What ``RobotKnowledge.load`` reads."""

    def __init__(self, case, robot):
        self.object_inertia, self.p_LE = case.team.object_inertia, np.array([robot.X_LE.x, robot.X_LE.y])
        self.load_share = case.scenario.load_share(robot.name, len(case.team.robots))


def test_boxes_that_are_left_when_there_are_too_many_keep_their_bounds(monkeypatch):
    case = Case(load_scenario("base"), 0.5)
    tight = cell_couplings(case.budget, case.tree, case.cells)
    monkeypatch.setattr(coupling, "MOST_BOXES", 30)
    loose = cell_couplings(case.budget, case.tree, case.cells)
    assert (loose.rates >= tight.rates / 1.15).all()
    assert (loose.rates > 1.1 * tight.rates).any()
    assert not cell_couplings(Budget(), case.tree, case.cells).rates.any()
