"""Questions of growing size, our planner and its peers on them: what is asked, counted and credited."""

import numpy as np
import pytest

from benchmarks.planner.cases import CASES
from benchmarks.planner.critical_width import Corridor, critical_interval
from benchmarks.planner.family import (
    corridor_problem,
    first_question,
)
from benchmarks.planner.head_to_head import judged
from benchmarks.planner.stages import STAGES, without_stage
from benchmarks.questions.peers import PeerRun, fault_of, run_ompl, run_trees
from benchmarks.smooth import limited_scenario
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.plant import planning_problem
from coop_drake.tree.component_tree import team_arrays

EASY = first_question()
STILL = np.zeros((0, 5))


def straight(problem, *goal_joints):
    return np.array([problem.start, [*problem.goal_pose, *goal_joints]])


HONEST = straight(EASY, 0.3, -0.2)


def starts_freely(problem):
    team = team_arrays(problem.tree)
    return is_free(team, grid_for_team(problem.workspace, team), problem.start.astype(float), 0.0)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_scenario_file_can_be_read_and_the_family_holds_the_shipped_one(case):
    problem = case.problem()
    assert starts_freely(problem)
    if case.name == "base":
        mine = corridor_problem()
        assert mine.workspace.equals(problem.workspace)
        assert np.array_equal(mine.start, problem.start)
        assert [one.range for one in mine.tree.joints] == [one.range for one in problem.tree.joints]


@pytest.mark.slow
@pytest.mark.parametrize("variant", STAGES)
def test_a_plan_is_found_without_any_one_stage(variant):
    replaced = [(part.module, part.name, getattr(part.module, part.name)) for part in STAGES[variant]]
    planned = without_stage(EASY, variant)
    assert planned.answer == "found"
    assert planned.transport_seconds > 0.0
    assert all(getattr(module, name) is value for module, name, value in replaced)


@pytest.mark.slow
def test_motions_take_longer_without_any_choice_that_shortens_them():
    problem = planning_problem(limited_scenario("elbow"))
    quickest = without_stage(problem, "everything").transport_seconds
    choices = ("no_candidates", "no_times_of_boxes", "no_targets", "no_moved_way")
    seconds = [without_stage(problem, choice).transport_seconds for choice in choices]
    assert 0.0 < quickest < min(seconds)
    assert max(seconds) == seconds[-1]
    assert without_stage(problem, "everything").transport_seconds == quickest


@pytest.mark.parametrize("run", [run_trees, run_ompl])
def test_a_peer_finds_a_path_that_holds_and_the_same_again_and_gives_up_when_its_budget_is_spent(run):
    question, budget, small = corridor_problem(), *((20_000, 2_000) if run is run_trees else (5.0, 0.2))
    first = [item for item in run(question, (1, 2, 3), budget) if item.found]
    assert not fault_of(question, first[0].path)
    again = {item.seed: item for item in run(question, (3, 2, 1), budget)}
    for item in first:
        assert np.array_equal(item.path, again[item.seed].path)
        assert item.checks == again[item.seed].checks > 0
    (only,) = run(corridor_problem(0.77), (1,), small)
    assert (only.found, only.checks > 0) == (False, True)


def test_honest_paths_pass_and_wrong_ones_are_told_apart():
    question = corridor_problem()
    assert fault_of(EASY, HONEST) == ""
    for asked, path, fault in (
        (question, straight(question, 0.0, 0.0), "collides"),
        (EASY, straight(EASY, 0.0, 0.0)[::-1], "begin"),
        (EASY, np.array([EASY.start, EASY.start]), "end"),
        (EASY, straight(EASY, 2.0, 0.0), "range"),
    ):
        assert fault in fault_of(asked, path)


def test_a_peer_is_judged_by_its_median_with_failures_and_wrong_paths_counted():
    paths = [HONEST] * 3 + [STILL, straight(EASY, 2.0, 0.0)]
    runs = [PeerRun(k, 0.1 * k, path, 10) for k, path in enumerate(paths, 1)]
    rows = {row.figure: (row.value, row.unit) for row in judged("planner/peer/easy", EASY, runs, "no time")}
    assert rows["found"] == (3, "of 5 within no time")
    assert rows["wrong"] == (1, "paths")
    assert [rows[name][0] for name in ("cpu_seconds", "fastest", "slowest")] == pytest.approx([0.3, 0.1, 0.3])


def asked(answer):
    """An interval of a planner that answers by the width itself, two seconds each."""
    return critical_interval(
        Corridor(lambda width: width, 0.7, 0.8, 1e-3), lambda width: (answer(width), 2.0)
    )


def test_bounds_meet_at_the_critical_width_and_undecided_ones_keep_them_apart():
    found = asked(lambda w: "infeasible" if w < 0.7314 else "beyond limits" if w < 0.75 else "found")
    assert found.no_way < 0.7314 <= found.way
    assert found.way - found.no_way <= 1e-3
    assert (found.undecided, set(found.seconds)) == ((), {2.0})
    found = asked(lambda w: "infeasible" if w < 0.72 else "found" if w > 0.74 else "undecided")
    assert 0.719 <= found.no_way < 0.72
    assert 0.74 < found.way <= 0.741
    assert all(0.72 <= width <= 0.74 for width in found.undecided)
    assert len(found.seconds) < 20
