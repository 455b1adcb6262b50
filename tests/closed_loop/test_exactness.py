"""The whole loop on small transports of any team: an exact law, margins, certified switches, arrival."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.plant.model_writing import polygon_body_files, write_polygon_body
from coop_drake.scenario import load_scenario
from coop_drake.simulation import build_maps, simulate
from tests.support.edited_scenario import write_edited, write_with_robot
from tests.support.hand_over import assert_certified
from tests.support.random_plan import random_plan
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.robot_models import Arm
from tests.support.run_checks import verified_run
from tests.support.same_runs import differences
from tests.support.small_loop import joint_names, small_maps, small_problem
from tests.support.small_plan import round_trip, small_plan
from tests.support.small_scenario import in_open_room

ONE, TWO, THREE = (REVOLUTE,), (REVOLUTE, REVOLUTE), (REVOLUTE, REVOLUTE, REVOLUTE)
SLIDE, MIXED = (PRISMATIC,), (PRISMATIC, REVOLUTE)
SHIPPED = {
    "two robots, one joint": ("base", ScheduledGains()),
    "two robots, two joints": ("elbow", ScheduledGains()),
    "three robots": ("three", ScheduledGains()),
    "the paper's gains": ("base", FixedGains()),
}
DAMPED = "<limit><lower>-1</lower><upper>1</upper></limit><dynamics><damping>2</damping></dynamics>"
ARMS = {
    "a sliding arm": Arm(joints=MIXED),
    "an arm upside down": Arm(joints=TWO, roll=pi),
    "a damped arm": Arm(joints=(("revolute", "0 0 1", DAMPED),)),
    "no joints": Arm(joints=()),
}
EDITED = {
    "an object with its centre of mass aside": ("package://coop_drake_models/object.sdf", "angle_iron.sdf"),
    "unequal shares": ("object: object\n", "object: object\nload_shares: {robot_0: 0.8, robot_1: 0.2}\n"),
}
ANGLE_IRON = ((-0.4, -0.25), (0.4, -0.25), (0.4, 0.0), (-0.1, 0.0), (-0.1, 0.35), (-0.4, 0.35))
RINGS = {
    "a ring of two": [ONE, MIXED],
    "three on one half": [TWO, SLIDE, THREE],
    "a ring of four": [ONE, TWO, SLIDE, THREE],
    "a ring of eight": [ONE, TWO, (), SLIDE, ONE, MIXED, THREE, ONE],
}
RANDOM = {f"random {seed}": seed for seed in range(4)}
QUICK = [*SHIPPED, *EDITED, "random 0", "random 1"]
SLOW = [*ARMS, *RINGS, "random 2", "random 3"]


def asked(name, folder):
    """Scenario, plan by hand and maps of a team; None for maps of its own. Rings go through thirty cells."""
    if name in SHIPPED:
        return *small_problem(*SHIPPED[name]), small_maps()
    if name in RINGS:
        scenario = ring_team(folder, RINGS[name], arc=pi if name == "three on one half" else 2.0 * pi)
        return scenario, round_trip(joint_names(scenario)), None
    if name in RANDOM:
        rng = np.random.default_rng(RANDOM[name])
        arms = [
            tuple((REVOLUTE, PRISMATIC)[i] for i in rng.integers(0, 2, rng.integers(0, 3))) for _ in range(3)
        ]
        scenario = in_open_room(ring_team(folder, arms, RANDOM[name], mass=rng.uniform(1.0, 30.0)))
        return scenario, random_plan(rng, joint_names(scenario), cells=3), None
    if name in ARMS:
        start = ("robot_0: [0.0]", f"robot_0: {[0.0] * len(ARMS[name].joints)}")
        path = write_with_robot(folder, ARMS[name].text(), "sdf", start)
    else:
        grasps = [(0.4, -0.15, 0.0), (-0.4, 0.2, pi)]
        write_polygon_body(polygon_body_files(ANGLE_IRON, 7.0, "angle_iron", grasps=grasps), folder)
        path = write_edited(folder, EDITED[name])
    scenario = in_open_room(load_scenario(path))
    return scenario, small_plan(joint_names(scenario)), small_maps()


@pytest.fixture(
    scope="module",
    params=[*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)],
)
def run(request, tmp_path_factory):
    scenario, plan, maps = asked(request.param, tmp_path_factory.mktemp("team"))
    log = simulate(scenario, plan, build_maps(plan) if maps is None else maps)
    assert (log.reached, log.violation) == (True, "")
    return request.param, scenario, plan, log


def test_the_object_arrives_at_rest_with_all_margins_positive(run):
    _, scenario, plan, log = run
    assert log.joint_names == plan.joint_names
    assert np.all(np.diff(log.times) > 0.0)
    tolerances = scenario.goal.tolerances
    assert np.linalg.norm(log.object_pose[-1, :2] - plan.goal_pose[:2]) < tolerances.position
    assert abs(log.object_pose[-1, 2] - plan.goal_pose[2]) < tolerances.angle
    assert np.linalg.norm(log.object_twist[-1, :2]) < 0.01
    for name in ("workspace_clearance", "body_clearance", "cell_clearance", "funnel_margin", "slice_margin"):
        assert getattr(log, name).min() > 0.0, name
    assert log.energy_margin.min() >= 0.0


def test_every_equation_holds_but_for_rounding_and_every_robot_carries_its_share(run):
    name, scenario, _, log = run
    largest = np.abs(np.gradient(log.object_twist, log.times, axis=0)).max()
    assert log.acceleration_error.max() <= 1e-12 * max(1.0, largest)
    assert log.wrench_error.max() <= 1e-10
    assert log.governor_spread.max() == 0.0
    robots = len(log.robot_names)
    shares = np.array([scenario.load_shares.get(robot, 1.0 / robots) for robot in log.robot_names])
    assert (np.ptp(shares) > 0.01) == (name in (*RINGS, *RANDOM, "unequal shares"))
    carried = shares[:, None] * log.object_wrench[:, None, :2]
    np.testing.assert_allclose(log.measured_wrenches[:, :, :2], carried, atol=1e-7)
    assert np.abs(log.object_wrench[:, :2]).max() > 1.0


def test_cells_are_walked_one_by_one_and_every_switch_is_certified(run):
    _, _, plan, log = run
    steps = np.diff(log.cell_index)
    assert (log.cell_index[0], log.cell_index[-1], set(steps) <= {0, 1}) == (0, len(plan.cells) - 1, True)
    for row in np.flatnonzero(steps):
        # The entry time is the last row before the first one in the new cell.
        assert log.transition_start[row + 1] == log.times[row]
        transition = plan.transitions[log.cell_index[row]]
        axes = np.concatenate([log.object_pose[row, 2:], log.joints[row]])
        assert np.all((transition.goal_lower < axes) & (axes < transition.goal_upper))
    assert_certified(plan, log)


def test_logs_are_verified(run):
    _, scenario, plan, log = run
    assert verified_run(scenario, plan, log).answer == "arrived"


def with_simulator(scenario, **settings):
    return replace(scenario, simulator=replace(scenario.simulator, **settings))


def test_the_same_run_twice_is_the_same_log_and_an_observer_sees_every_step_and_changes_nothing():
    scenario, plan = small_problem("base")
    scenario, seen = with_simulator(scenario, max_time=0.5), []
    watched = simulate(scenario, plan, small_maps(), observer=lambda sample: seen.append(sample.time))
    assert seen == watched.times.tolist()
    assert differences(watched, simulate(scenario, plan, small_maps())) == []


def test_robots_move_the_object_together_at_any_accuracy():
    scenario, plan = small_problem("base")
    fine = simulate(scenario, plan, small_maps())
    coarse = simulate(with_simulator(scenario, accuracy=1e-2, max_step_size=0.05), plan, small_maps())
    assert coarse.reached
    assert coarse.acceleration_error.max() <= 1e-9
    assert len(coarse.times) < len(fine.times)


@pytest.mark.slow
@pytest.mark.parametrize(("gain_set", "steps"), [(None, False), (FixedGains(), True)])
def test_forces_go_on_where_they_were_unless_gains_step_as_printed(gain_set, steps):
    """The change over a step that holds a switch, beside 1.5 times the largest of all others."""
    scenario, plan = small_problem("base", gain_set)
    log = simulate(with_simulator(scenario, max_step_size=0.002, max_time=2.5), plan, small_maps())
    efforts = np.hstack([log.base_wrenches[..., :2].reshape(len(log.times), -1), log.joint_torques])
    changes = np.abs(np.diff(efforts, axis=0)).max(axis=1)
    switches = np.flatnonzero(np.diff(log.cell_index))
    assert len(switches) >= 1
    assert (changes[switches].max() > 1.5 * np.delete(changes, switches).max()) == steps
    if not steps:
        assert np.abs(efforts[0]).max() < 1e-6
