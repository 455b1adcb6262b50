"""Runs that must fail, and must say why."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from coop_drake.simulation import run, simulate
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ROOM
from tests.support.small_scenario import small_scenario


@pytest.fixture(scope="module")
def problem():
    return small_problem("base")


def with_cell(plan, index, **changes):
    cells = [replace(cell, **changes) if k == index else cell for k, cell in enumerate(plan.cells)]
    return replace(plan, cells=tuple(cells))


def with_transition(plan, index, **changes):
    transitions = [replace(one, **changes) if k == index else one for k, one in enumerate(plan.transitions)]
    return replace(plan, transitions=tuple(transitions))


def failed(scenario, plan, seconds=None):
    if seconds is not None:
        scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=seconds))
    log = simulate(scenario, plan, small_maps())
    assert not log.reached
    return log


def test_a_wall_moved_into_the_cell_is_hit_and_named(problem):
    log = failed(small_scenario("base", box(0.0, 0.0, 6.0, 7.0)), problem[1])
    assert "clearance between robot_" in log.violation
    assert "and the walls is -" in log.violation
    assert f"at t = {log.times[-1]:.6g} s in cell {log.cell_index[-1]}" in log.violation
    assert log.workspace_clearance[-1] <= 0.0 < log.workspace_clearance[:-1].min()


def test_a_start_in_a_wall_ends_the_run_at_once(problem):
    log = failed(small_scenario("base", ROOM - box(2.9, 2.9, 3.1, 3.1)), problem[1])
    assert len(log.times) == 1
    assert log.violation.startswith("at t = 0 s in cell 0: clearance between object::body and the walls is -")


START = box(2.9, 2.9, 3.1, 3.1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda plan: {"tidied": plan.cells[0].tidied - START},
            "distance of the object to the boundary of cell 0 is -",
        ),
        (
            lambda plan: {"upper": np.array([0.15, 0.3, 0.3])},
            "distance of object angle to its slice is -",
        ),
        (lambda plan: {"tidied": box(2.2, 2.2, 4.4, 2.9)}, "Delta E is -"),
    ],
)
def test_a_cell_that_does_not_hold_the_team_is_a_violation(problem, change, words):
    scenario, plan = problem
    assert words in failed(scenario, with_cell(plan, 0, **change(plan))).violation


def test_a_cell_that_is_never_left_stalls_and_names_what_blocks(problem, monkeypatch):
    monkeypatch.setattr(run, "PATIENCE_ALLOWANCE", 0.5)
    scenario, plan = problem
    shut = replace(plan.transitions[1].gains, energy_bound=np.zeros(3))
    never = with_transition(with_transition(plan, 1, gains=shut), 0, estimated_time=0.1)
    said = failed(scenario, never).violation
    assert said.startswith("stalled at t = 1.5")
    assert "in cell 0 of 3, entered at 0 s with 0.1 s estimated" in said
    assert "it waits until the energy of " in said
    assert "falls below the next funnel's bound (margin -" in said
    away = with_transition(with_cell(plan, 1, tidied=box(8.0, 5.0, 9.0, 6.0)), 0, estimated_time=0.1)
    said = failed(scenario, away).violation
    assert "it waits until the object's position is safe in the next cell (Delta E) (margin -" in said


def test_too_little_time_and_a_goal_that_is_not_reached_are_reported_with_what_is_missing(problem):
    scenario, plan = problem
    said = failed(scenario, plan, 0.2).violation
    assert said.startswith("no arrival within max_time = 0.2 s at t = 0.2 s in cell 0 of 3")
    elsewhere = replace(plan, goal_pose=plan.goal_pose + np.array([0.5, 0.0, 0.0]))
    said = failed(scenario, elsewhere, 4.0).violation
    assert "it waits until the object reaches its goal position (margin -" in said


def test_progress_grows_to_one_and_ctrl_c_passes_through(problem):
    told = []
    log = simulate(*problem, small_maps(), progress=lambda stage, part: told.append((stage, part)))
    assert log.reached
    assert {stage for stage, _ in told} == {"simulating"}
    parts = [part for _, part in told]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0

    def interrupt(stage, fraction):
        if fraction > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*problem, small_maps(), progress=interrupt)
