"""Random questions are the same for the same seed and begin without collision; answers are judged fairly."""

import json
from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest
import shapely
from shapely import box

from benchmarks.questions import answering
from benchmarks.questions.answering import QuestionRecord, answer, ask, sampled_margin
from benchmarks.questions.floors import FLOORS, random_floor
from benchmarks.questions.peers import Searched, fault_of, search_by_peers
from benchmarks.questions.question import narrowest_corridor, random_question
from benchmarks.questions.settings import QuestionSettings
from benchmarks.questions.teams import SHAPES, random_count, random_team
from coop_drake.answers import Found, Infeasible, Undecided
from coop_drake.answers.plan import SearchReport
from coop_drake.answers.problem import at_goal
from coop_drake.planning.planner import plan
from coop_drake.plant import planning_problem
from coop_drake.plant.problem import collisions
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.support.cases import rectangle

SMALL = QuestionSettings(seeds=(3,), robots=(2,), most_joints=1, floors=("room",), peer_time=0.0)


@pytest.fixture(scope="module")
def question(tmp_path_factory):
    return random_question(SMALL, 5, tmp_path_factory.mktemp("question"))


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_seed_and_a_number_determine_all_files(question, tmp_path):
    again = random_question(SMALL, 5, tmp_path / "again")
    other = random_question(SMALL, 1, tmp_path / "other")
    before = files(question.scenario.path.parent)
    assert files(again.scenario.path.parent) == before
    assert again.width_ratio == question.width_ratio or isnan(question.width_ratio)
    assert set(files(other.scenario.path.parent).values()).isdisjoint(before.values())


def test_a_question_is_an_ordinary_scenario_that_begins_and_ends_without_collision(question):
    problem = planning_problem(load_scenario(question.scenario.path))
    np.testing.assert_array_equal(problem.start, question.problem.start)
    assert list(collisions(problem.tree, problem.start, problem.workspace)) == []
    assert question.robots == 2
    assert question.kind.split(",")[0] in SHAPES


def test_some_joints_have_goals_at_which_the_team_is_free(tmp_path):
    asked = QuestionSettings(seeds=(3,), robots=(2,), most_joints=2, floors=("door",))
    for number in range(30):
        problem = random_question(asked, number, tmp_path / str(number)).problem
        if any(goal is not None for goal in problem.goal_joints):
            break
    free = [joint.index for joint in problem.tree.joints if problem.goal_joints[joint.index] is None]
    random = np.random.default_rng(0)
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    tried = (
        at_goal(problem.goal_pose, problem.goal_joints, random.uniform(lower, upper)) for _ in range(300)
    )
    assert free
    assert any(not list(collisions(problem.tree, z, problem.workspace)) for z in tried)


@pytest.mark.parametrize("kind", FLOORS)
def test_floors_hold_the_regions_of_start_and_goal(kind):
    drawn = [random_floor(np.random.default_rng([1, k]), kind, 1.5, 0.9) for k in range(20)]
    floors = [floor for floor in drawn if floor is not None]
    assert len(floors) > 10
    for floor in floors:
        assert floor.polygon.is_valid
        assert floor.polygon.intersects(floor.first)
        assert floor.polygon.intersects(floor.last)
        assert isnan(floor.width) if kind == "room" else 0.5 < floor.width < 2.0


def test_teams_have_every_shape_every_number_of_joints_and_sliding_ones():
    random = np.random.default_rng(2)
    teams = [team for team in (random_team(random, 3, 3) for _ in range(200)) if team is not None]
    assert {team.shape for team in teams} == set(SHAPES)
    assert {len(arm.slides) for team in teams for arm in team.arms} == {1, 2, 3}
    assert {team.kind for team in teams} >= {"U", "U, prismatic"}
    counts = [random_count(random, (2, 3, 4, 5)) for _ in range(400)]
    assert counts.count(2) > counts.count(3) > counts.count(4) > counts.count(5) > 0


def test_the_narrowest_corridor_of_a_bar_is_as_wide_as_the_bar():
    bar = Component("bar", None, None, (Body("bar", None, (rectangle(-1.0, 1.0, -0.2, 0.2),)),))
    width = narrowest_corridor(ComponentTree((bar,), frozenset()), np.random.default_rng(1))
    assert width == pytest.approx(0.4, abs=1e-3)
    assert width >= 0.4


@pytest.fixture(scope="module")
def planned(question):
    """The answer that the planner gives, once for all tests."""
    found = plan(question.problem, question.scenario.gain_sets["scheduled"], gain_set_name="scheduled")
    assert isinstance(found, Found)
    return found


def test_sampled_cells_keep_bodies_apart_and_moved_ones_do_not(question, planned):
    problem, plan = question.problem, planned.plan
    assert sampled_margin(problem, plan, 40, 1) > 0.0
    moved = plan.cells[0].tidied.buffer(0.05, join_style="mitre")
    forged = replace(plan, cells=(replace(plan.cells[0], tidied=moved), *plan.cells[1:]))
    assert sampled_margin(problem, forged, 40, 1) <= 0.0


def test_one_sample_of_a_thin_cell_is_taken(question, planned):
    problem, plan = question.problem, planned.plan
    thin = shapely.LineString([(0.0, 0.0), (1.0, 1.0)]).buffer(1e-9)
    cell = replace(plan.cells[0], tidied=thin)
    assert sampled_margin(problem, replace(plan, cells=(cell,)), 1, 1) <= 0.0  # It leads out of the floor.


def test_a_wider_interval_than_proved_is_found_by_sampling(question, planned):
    problem, plan = question.problem, planned.plan
    wider = [replace(cell, upper=cell.upper + 0.5) for cell in plan.cells]
    assert sampled_margin(problem, replace(plan, cells=tuple(wider)), 40, 1) <= 0.0


def test_other_planners_find_an_easy_path_and_none_through_a_wall(question):
    found = search_by_peers(replace(question.problem, workspace=box(-50.0, -50.0, 50.0, 50.0)), 5.0, 1)
    assert found.planners == ("trees",)
    assert found.path is not None
    x, y = question.problem.start[:2]
    island = box(x - 2.0, y - 2.0, x + 2.0, y + 2.0)
    closed = replace(question.problem, workspace=island, goal_pose=np.array([x + 9.0, y, 0.0]))
    nothing = search_by_peers(closed, 0.1, 1)
    assert nothing.path is None
    assert nothing.planners[0] == "trees"


def test_an_answer_is_checked_and_sampled(question, planned, monkeypatch):
    answered(monkeypatch, planned)
    record, found = answer(question, SMALL)
    assert (record.verdict, record.cells, record.verified) == ("plan", len(planned.plan.cells), True)
    assert record.first_plan_seconds == planned.report.first_plan_cpu_seconds
    assert record.sampled_margin > 0.0
    assert found == Searched()
    assert not record.is_wrong


def test_a_plan_for_another_question_is_wrong(question, planned, monkeypatch):
    right = planned.plan
    answered(monkeypatch, Found(replace(right, start=right.start + 0.1), SearchReport(1, 0.5)))
    record, _ = answer(question, SMALL)
    assert not record.verified
    assert record.reason
    assert record.is_wrong


def test_a_no_is_searched_against(question, monkeypatch):
    answered(monkeypatch, Infeasible("no way", SearchReport(1)))
    record, found = answer(question, replace(SMALL, peer_time=5.0))
    assert (record.verdict, record.verified, record.peer, record.peer_found) == (
        "infeasible",
        False,
        "trees",
        True,
    )
    assert fault_of(question.problem, found.path) == ""
    assert record.is_wrong


def test_an_error_of_the_planner_is_wrong_and_kept(monkeypatch, tmp_path):
    def broken(*given, **named):
        raise ZeroDivisionError("no luck")

    monkeypatch.setattr(answering, "plan", broken)
    record = ask(5, SMALL, tmp_path)
    assert (record.verdict, record.reason) == ("failed", "ZeroDivisionError: no luck")
    assert record.is_wrong
    kept = tmp_path / "3_5"
    assert load_scenario(kept).path.name == "question_3_5.scenario.yaml"
    assert "no luck" in (kept / "found.json").read_text()


def test_an_answer_takes_no_longer_than_the_limit(question):
    record, _ = answer(question, replace(SMALL, time_limit=1e-6, patient_peer_time=0.0))
    assert record.verdict == "undecided"
    assert record.reason.startswith("not answered within 1e-06 s, when it was ")
    assert not record.is_wrong


def test_a_plan_whose_way_was_certified_within_the_limit_counts(question, monkeypatch):
    def slow(problem, gains, *, gain_set_name, progress):
        def passing(phase, fraction):
            if phase.startswith("searching at margin"):
                monkeypatch.setattr(answering, "process_time", lambda: 1e9)
            progress(phase, fraction)

        return plan(problem, gains, gain_set_name=gain_set_name, progress=passing)

    monkeypatch.setattr(answering, "plan", slow)
    record, found = answer(question, SMALL)
    assert (record.verdict, record.verified, found) == ("plan", True, Searched())
    assert record.reason.startswith(f"{answering.LATE} after {SMALL.time_limit:g} s, when it was searching")
    assert record.sampled_margin > 0.0
    assert not record.is_wrong


def test_an_undecided_question_for_which_a_peer_finds_a_way_is_kept(monkeypatch, tmp_path):
    answered(monkeypatch, Undecided("too narrow", SearchReport(7)))
    path = np.zeros((2, 5))
    monkeypatch.setattr(answering, "search_by_peers", lambda *given: Searched(("trees",), path, 0.2))
    record = ask(5, SMALL, tmp_path)
    assert (record.peer, record.peer_found, record.peer_seconds) == ("trees", True, 0.2)
    assert record.reason == "too narrow"
    kept = json.loads((tmp_path / "3_5" / "found.json").read_text())
    assert kept["path"] == path.tolist()
    assert kept["record"]["reason"] == "too narrow"


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({}, False),
        ({"verified": False}, True),
        ({"sampled_margin": 0.0}, True),
        ({"verdict": "infeasible", "peer_found": True}, True),
        ({"verdict": "infeasible", "sampled_margin": nan}, False),
        ({"verdict": "undecided", "verified": False, "peer_found": True}, False),
    ],
)
def test_what_makes_an_answer_wrong(changes, wrong):
    record = QuestionRecord(0, 1, "room", 2, 2, "bar", "plan", verified=True, sampled_margin=1e-6)
    assert replace(record, **changes).is_wrong is wrong


def answered(monkeypatch, result):
    monkeypatch.setattr(answering, "plan", lambda *given, **named: result)
