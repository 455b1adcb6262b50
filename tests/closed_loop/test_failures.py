"""Runs that must fail, and must say why."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.plan import Plan
from coop_drake.simulation import run, simulate
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ROOM
from tests.support.small_scenario import small_scenario


@pytest.fixture(scope="module")
def problem():
    return small_problem("base")


def with_cell(plan: Plan, index: int, **changes) -> Plan:
    cells = list(plan.cells)
    cells[index] = replace(cells[index], **changes)
    return replace(plan, cells=tuple(cells))


def with_transition(plan: Plan, index: int, **changes) -> Plan:
    transitions = list(plan.transitions)
    transitions[index] = replace(transitions[index], **changes)
    return replace(plan, transitions=tuple(transitions))


def with_limit(scenario, seconds):
    return replace(scenario, simulator=replace(scenario.simulator, max_time=seconds))


def test_a_wall_moved_into_the_cell_is_hit_and_named(problem):
    _, plan = problem
    scenario = small_scenario("base", box(0.0, 0.0, 6.0, 7.0))
    log = simulate(scenario, plan, small_maps())
    assert not log.reached
    assert "clearance between robot_" in log.violation
    assert "and the walls is -" in log.violation
    assert f"at t = {log.times[-1]:.6g} s in cell {log.cell_index[-1]}" in log.violation
    assert log.workspace_clearance[-1] <= 0.0 < log.workspace_clearance[:-1].min()


def test_a_start_in_a_wall_ends_the_run_at_once(problem):
    _, plan = problem
    log = simulate(small_scenario("base", ROOM - box(2.9, 2.9, 3.1, 3.1)), plan, small_maps())
    assert len(log.times) == 1
    assert log.violation.startswith("at t = 0 s in cell 0: clearance between object::body and the walls is -")


def test_an_object_outside_its_cell_is_a_violation(problem):
    scenario, plan = problem
    x, y = plan.start[:2]
    tidied = plan.cells[0].tidied - box(x - 0.1, y - 0.1, x + 0.1, y + 0.1)
    log = simulate(scenario, with_cell(plan, 0, tidied=tidied), small_maps())
    assert not log.reached
    assert "distance of the object to the boundary of cell 0 is -" in log.violation


def test_an_angle_outside_its_slice_is_a_violation(problem):
    scenario, plan = problem
    upper = np.array([0.15, 0.3, 0.3])
    log = simulate(scenario, with_cell(plan, 0, upper=upper), small_maps())
    assert "distance of object angle to its slice is -" in log.violation


def test_a_clearance_that_is_too_small_for_the_energy_is_a_violation(problem):
    scenario, plan = problem
    log = simulate(scenario, with_cell(plan, 0, tidied=box(2.2, 2.2, 4.4, 2.9)), small_maps())
    assert "Delta E is -" in log.violation


def test_a_cell_that_is_never_left_stalls_and_names_what_blocks(problem, monkeypatch):
    monkeypatch.setattr(run, "PATIENCE_ALLOWANCE", 0.5)
    scenario, plan = problem
    shut = replace(plan.transitions[1].gains, energy_bound=np.zeros(3))
    never = with_transition(with_transition(plan, 1, gains=shut), 0, estimated_time=0.1)
    log = simulate(scenario, never, small_maps())
    assert not log.reached
    assert log.violation.startswith("stalled at t = 1.5")
    assert "in cell 0 of 3, entered at 0 s with 0.1 s estimated" in log.violation
    assert "it waits until the energy of " in log.violation
    assert "falls below the next funnel's bound (margin -" in log.violation


def test_a_next_cell_out_of_reach_is_named_as_what_blocks(problem, monkeypatch):
    monkeypatch.setattr(run, "PATIENCE_ALLOWANCE", 0.5)
    scenario, plan = problem
    away = with_cell(plan, 1, tidied=box(8.0, 5.0, 9.0, 6.0))
    log = simulate(scenario, with_transition(away, 0, estimated_time=0.1), small_maps())
    blocking = "the object's position is safe in the next cell (Delta E) (margin -"
    assert f"it waits until {blocking}" in log.violation


def test_too_little_time_is_reported_with_what_is_missing(problem):
    scenario, plan = problem
    log = simulate(with_limit(scenario, 0.2), plan, small_maps())
    assert not log.reached
    assert log.violation.startswith("no arrival within max_time = 0.2 s at t = 0.2 s in cell 0 of 3")


def test_a_last_cell_without_arrival_names_the_goal(problem):
    scenario, plan = problem
    goal = plan.goal_pose + np.array([0.5, 0.0, 0.0])
    log = simulate(with_limit(scenario, 4.0), replace(plan, goal_pose=goal), small_maps())
    assert "it waits until the object reaches its goal position (margin -" in log.violation


def test_ctrl_c_passes_through(problem):
    scenario, plan = problem

    def interrupt(stage, fraction):
        assert stage == "simulating"
        if fraction > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(scenario, plan, small_maps(), progress=interrupt)


def test_progress_grows_to_one(problem):
    scenario, plan = problem
    told = []
    log = simulate(scenario, plan, small_maps(), progress=lambda stage, part: told.append((stage, part)))
    assert log.reached
    assert {stage for stage, _ in told} == {"simulating"}
    parts = [part for _, part in told]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
