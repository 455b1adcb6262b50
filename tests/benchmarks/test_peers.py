"""Peers find paths that hold, the same for the same seed; a wrong path is not credited to anybody."""

import numpy as np
import pytest

from benchmarks.planner.family import corridor_problem, first_question
from benchmarks.planner.gcs_peer import run_gcs
from benchmarks.planner.guarantees import guarantee_table
from benchmarks.planner.head_to_head import judged
from benchmarks.questions.peers import PeerRun, fault_of, free_goals, prepared_check, run_ompl, run_trees
from benchmarks.rows import Row

EASY = first_question()
STILL = np.zeros((0, 5))


def straight(problem, goal_joints):
    goal = np.concatenate((problem.goal_pose, goal_joints))
    return np.array([problem.start, goal])


@pytest.mark.parametrize("run", [run_trees, run_ompl])
def test_a_peer_finds_a_path_that_holds_and_the_same_again(run):
    question, budget = corridor_problem(), 20_000 if run is run_trees else 5.0
    first = [item for item in run(question, (1, 2, 3), budget) if item.found]
    assert first
    assert all(not fault_of(question, item.path) for item in first[:1])
    again = {item.seed: item for item in run(question, (3, 2, 1), budget)}
    for item in first:
        assert np.array_equal(item.path, again[item.seed].path)
        assert item.checks == again[item.seed].checks > 0


@pytest.mark.parametrize(("run", "budget"), [(run_trees, 2_000), (run_ompl, 0.2)])
def test_a_peer_gives_up_when_its_budget_is_spent(run, budget):
    (only,) = run(corridor_problem(0.77), (1,), budget)
    assert not only.found
    assert only.checks > 0


def test_goals_keep_joints_that_are_asked_for():
    check = prepared_check(EASY)
    free = free_goals(EASY, check, 5, seed=1)
    assert free.shape == (5, 5)
    assert (free[:, :3] == EASY.goal_pose).all()
    assert len(np.unique(free[:, 3])) == 5


def test_an_honest_path_passes():
    assert fault_of(EASY, straight(EASY, [0.3, -0.2])) == ""


def test_wrong_paths_are_told_apart():
    question = corridor_problem()
    through_walls = straight(question, [0.0, 0.0])
    assert "collides" in fault_of(question, through_walls)
    assert "begin" in fault_of(EASY, straight(EASY, [0.0, 0.0])[::-1])
    assert "end" in fault_of(EASY, np.array([EASY.start, EASY.start]))
    assert "range" in fault_of(EASY, straight(EASY, [2.0, 0.0]))


def test_only_paths_that_hold_are_counted():
    question = corridor_problem()
    wrong = PeerRun(1, 0.1, straight(question, [0.0, 0.0]), 10)
    rows = judged("planner/peer/base", question, [wrong, PeerRun(2, 0.2, STILL, 10)], "no time")
    assert {row.figure: (row.value, row.unit) for row in rows} == {
        "found": (0, "of 2 within no time"),
        "wrong": (1, "paths"),
    }


def test_a_peer_is_judged_by_its_median_with_failures_counted():
    runs = [PeerRun(k, 0.1 * k, straight(EASY, [0.3, -0.2]) if k < 3 else STILL, 10) for k in (1, 2, 3)]
    rows = judged("planner/peer/easy", EASY, runs, "no time")
    values = {row.figure: row.value for row in rows}
    assert (values["found"], values["wrong"], values["cpu_seconds"]) == (2, 0, 0.2)
    assert (values["fastest"], values["slowest"]) == (0.1, 0.2)


@pytest.mark.slow
def test_regions_of_drake_s_planner_hold_a_path_between_walls():
    run = run_gcs(EASY, 60.0)
    assert run.regions > 0
    assert fault_of(EASY, run.path) == ""


def test_drake_s_planner_without_time_finds_nothing():
    run = run_gcs(EASY, -1.0)
    assert (run.regions, len(run.path)) == (0, 0)


def test_planners_are_shown_with_their_times_and_guarantees():
    rows = [
        Row("planner/base/first_plan_cpu_seconds", 0.1, "s"),
        Row("planner/tight/first_plan_cpu_seconds", 0.3, "s"),
        Row("planner/ompl/base/found", 10, "of 10 within 8 CPU s"),
        Row("planner/ompl/base/cpu_seconds", 0.07, "s"),
        Row("planner/gcs/base/found", 0, "of 1 within 300 CPU s for regions"),
    ]
    table = guarantee_table(rows)
    assert [column.header for column in table.columns] == ["planner", "base", "guaranteed"]
    assert list(table.columns[1].cells) == ["0.1", "0.07 (10 of 10)", "– (0 of 1)"]
    assert guarantee_table(rows[:2]) is None
