"""The whole loop on a small transport: exactness, invariants, switches, arrival."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.simulation import communication, simulate
from tests.support.hand_over import assert_certified
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ANGLE_TOLERANCE, POSITION_TOLERANCE

RUNS = {
    "two robots, one joint": ("base", ScheduledGains()),
    "two robots, two joints": ("elbow", ScheduledGains()),
    "three robots": ("three", ScheduledGains()),
    "the paper's gains": ("base", FixedGains()),
}


@pytest.fixture(scope="module", params=RUNS, ids=lambda name: name.replace(" ", "-"))
def run(request):
    team, gain_set = RUNS[request.param]
    scenario, plan = small_problem(team, gain_set)
    return plan, simulate(scenario, plan, small_maps())


def test_the_object_arrives_and_rests(run):
    plan, log = run
    assert log.violation == ""
    assert log.reached
    assert np.linalg.norm(log.object_pose[-1, :2] - plan.goal_pose[:2]) < POSITION_TOLERANCE
    assert abs(log.object_pose[-1, 2] - plan.goal_pose[2]) < ANGLE_TOLERANCE
    assert np.linalg.norm(log.object_twist[-1, :2]) < 0.01


def test_the_object_accelerates_as_commanded_but_for_rounding(run):
    _, log = run
    largest = np.abs(np.gradient(log.object_twist, log.times, axis=0)).max()
    assert log.acceleration_error.max() <= 1e-12 * max(1.0, largest)


def test_every_robot_has_the_same_governor_bit_by_bit(run):
    _, log = run
    assert log.governor_spread.max() == 0.0


def test_every_grasp_transmits_the_share_of_the_wrench(run):
    _, log = run
    assert log.wrench_error.max() <= 1e-10
    np.testing.assert_allclose(
        log.measured_wrenches[:, :, :2].sum(axis=1), log.object_wrench[:, :2], atol=1e-7
    )


def test_all_margins_are_positive_on_every_accepted_step(run):
    _, log = run
    for name in ("workspace_clearance", "body_clearance", "cell_clearance", "funnel_margin", "slice_margin"):
        assert getattr(log, name).min() > 0.0, name
    assert log.energy_margin.min() >= 0.0


def test_robots_say_little_and_all_of_it_counts(run):
    plan, log = run
    statistics = communication(log)
    robots = len(log.robot_names)
    assert all(count >= len(plan.cells) for count in statistics.reports)
    assert statistics.announcements == robots * (len(plan.cells) - 1)
    assert statistics.messages < 10 * robots * len(plan.cells)


def test_the_cells_are_walked_one_by_one_and_all_agree_when(run):
    plan, log = run
    steps = np.diff(log.cell_index)
    assert log.cell_index[0] == 0
    assert log.cell_index[-1] == len(plan.cells) - 1
    assert set(steps) <= {0, 1}
    # The entry time is the last row before the first one in the new cell.
    for row in np.flatnonzero(steps):
        assert log.transition_start[row + 1] == log.times[row]


def test_at_every_switch_the_next_goal_was_reached(run):
    plan, log = run
    for row in np.flatnonzero(np.diff(log.cell_index)):
        transition = plan.transitions[log.cell_index[row]]
        axes = np.concatenate([log.object_pose[row, 2:], log.joints[row]])
        assert np.all(axes > transition.goal_lower)
        assert np.all(axes < transition.goal_upper)


def test_at_every_switch_the_next_cell_with_its_own_gains_was_certified(run):
    assert_certified(*run)


def test_funnels_start_on_the_slice_and_hold_the_axes(run):
    plan, log = run
    axes = np.hstack([log.object_pose[:, 2:], log.joints])
    assert np.all(log.funnel_lower < axes)
    assert np.all(axes < log.funnel_upper)
    np.testing.assert_allclose(log.funnel_lower[0], plan.cells[0].lower, atol=1e-12)
    np.testing.assert_allclose(log.funnel_upper[0], plan.cells[0].upper, atol=1e-12)


def test_the_log_says_who_is_who(run):
    plan, log = run
    rows = len(log.times)
    assert log.joint_names == plan.joint_names
    assert log.joints.shape == (rows, len(plan.joint_names))
    assert log.base_poses.shape == (rows, len(log.robot_names), 3)
    assert np.all(np.diff(log.times) > 0.0)


def test_the_same_run_twice_is_the_same_log():
    scenario, plan = small_problem("base")
    scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=0.5))
    first, second = (simulate(scenario, plan, small_maps()) for _ in range(2))
    for name in ("times", "object_pose", "joints", "base_wrenches", "measured_wrenches", "energy_margin"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_robots_move_the_object_together_at_any_accuracy():
    scenario, plan = small_problem("base")
    fine = simulate(scenario, plan, small_maps())
    coarse = simulate(
        replace(scenario, simulator=replace(scenario.simulator, accuracy=1e-2, max_step_size=0.05)),
        plan,
        small_maps(),
    )
    assert coarse.reached
    assert coarse.acceleration_error.max() <= 1e-9
    assert len(coarse.times) < len(fine.times)


def test_an_observer_sees_every_step_and_changes_nothing():
    scenario, plan = small_problem("base")
    scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=0.1))
    seen = []
    watched = simulate(scenario, plan, small_maps(), observer=lambda sample: seen.append(sample.time))
    alone = simulate(scenario, plan, small_maps())
    assert seen == watched.times.tolist()
    assert np.array_equal(watched.object_pose, alone.object_pose)
    assert np.array_equal(watched.times, alone.times)
