"""Random questions are the same for the same seed and begin without collision; answers are judged fairly."""

import json
from dataclasses import asdict, replace
from math import isnan, nan

import numpy as np
import pytest
import shapely
from typer.testing import CliRunner

from benchmarks.app import app
from benchmarks.questions import answering
from benchmarks.questions.answering import (
    CASES,
    MEASURED,
    QuestionRecord,
    answer,
    ask,
    sampled_margin,
)
from benchmarks.questions.peers import Searched, fault_of
from benchmarks.questions.question import random_question
from benchmarks.questions.settings import QuestionSettings
from benchmarks.questions.summary import summarise_questions
from benchmarks.questions.teams import SHAPES
from benchmarks.study import Study, batches_of, load_study
from coop_drake.answers import Found, Infeasible, Undecided
from coop_drake.answers.plan import SearchReport
from coop_drake.campaign.execution import Order, make_batch
from coop_drake.campaign.plans import source_digest
from coop_drake.campaign.records import CampaignFolder, table_of
from coop_drake.planning.planner import plan
from coop_drake.plant import planning_problem
from coop_drake.plant.problem import collisions
from coop_drake.scenario import load_scenario

SMALL = QuestionSettings(seeds=(3,), robots=(2,), most_joints=1, floors=("room",), peer_time=0.0)
RIGHT = QuestionRecord(0, 3, "room", 2, 2, "bar", "plan", 1.5, verified=True, sampled_margin=1e-6)
FILE = """
questions: {count: 5, seeds: [3], robots: [2], most_joints: 1, floors: [room], batch: 2, peer_time: 0.0}
"""
LAST = 4
"""The only question of the last batch."""


@pytest.fixture(scope="module")
def question(tmp_path_factory):
    return random_question(SMALL, 5, tmp_path_factory.mktemp("question"))


def test_a_seed_and_a_number_determine_all_files(question, tmp_path):
    def files(asked):
        return {path.name: path.read_bytes() for path in asked.scenario.path.parent.iterdir()}

    again = random_question(SMALL, 5, tmp_path / "again")
    assert files(again) == files(question)
    assert again.width_ratio == question.width_ratio or isnan(question.width_ratio)
    other = files(random_question(SMALL, 1, tmp_path / "other"))
    assert set(other.values()).isdisjoint(files(question).values())


def test_a_question_is_an_ordinary_scenario_that_begins_and_ends_without_collision(question):
    problem = planning_problem(load_scenario(question.scenario.path))
    np.testing.assert_array_equal(problem.start, question.problem.start)
    assert list(collisions(problem.tree, problem.start, problem.workspace)) == []
    assert question.robots == 2
    assert question.kind.split(",")[0] in SHAPES


@pytest.fixture(scope="module")
def planned(question):
    """The answer that the planner gives, once for all tests."""
    found = plan(question.problem, question.scenario.gain_sets["scheduled"], gain_set_name="scheduled")
    assert isinstance(found, Found)
    return found


def test_sampled_cells_keep_bodies_apart_and_forged_ones_do_not(question, planned):
    """Forged are a larger cell, one thin cell that leads out of the floor, and wider intervals."""
    problem, plan = question.problem, planned.plan
    assert sampled_margin(problem, plan, 40, 1) > 0.0
    first, *others = plan.cells
    thin = shapely.LineString([(0.0, 0.0), (1.0, 1.0)]).buffer(1e-9)
    for cells in (
        (replace(first, tidied=first.tidied.buffer(0.05, join_style="mitre")), *others),
        (replace(first, tidied=thin),),
        tuple(replace(cell, upper=cell.upper + 0.5) for cell in plan.cells),
    ):
        assert sampled_margin(problem, replace(plan, cells=cells), 40 if len(cells) > 1 else 1, 1) <= 0.0


@pytest.fixture
def answered(monkeypatch):
    """Let the planner give an answer."""
    return lambda result: monkeypatch.setattr(answering, "plan", lambda *given, **named: result)


def test_an_answer_is_checked_and_sampled(question, planned, answered):
    answered(planned)
    record, found = answer(question, SMALL)
    assert (record.verdict, record.cells, record.verified) == ("plan", len(planned.plan.cells), True)
    assert record.first_plan_seconds == planned.report.first_plan_cpu_seconds
    assert record.sampled_margin > 0.0
    assert found == Searched()
    assert not record.is_wrong


def test_a_plan_for_another_question_is_wrong(question, planned, answered):
    answered(Found(replace(planned.plan, start=planned.plan.start + 0.1), SearchReport(1, 0.5)))
    record, _ = answer(question, SMALL)
    assert (record.verified, bool(record.reason), record.is_wrong) == (False, True, True)


def test_a_no_is_searched_against(question, answered):
    answered(Infeasible("no way", SearchReport(1)))
    record, found = answer(question, replace(SMALL, peer_time=5.0))
    assert (record.verdict, record.verified, record.peer, record.peer_found) == (
        "infeasible", False, "trees", True
    )  # fmt: skip
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
            if phase == "choosing boxes":
                monkeypatch.setattr(answering, "process_time", lambda: 1e9)
            progress(phase, fraction)

        return plan(problem, gains, gain_set_name=gain_set_name, progress=passing)

    monkeypatch.setattr(answering, "plan", slow)
    record, found = answer(question, SMALL)
    assert (record.verdict, record.verified, found) == ("plan", True, Searched())
    assert record.reason.startswith(
        f"{answering.LATE} after {SMALL.time_limit:g} s, when it was choosing boxes"
    )
    assert record.sampled_margin > 0.0
    assert not record.is_wrong


def test_an_undecided_question_for_which_a_peer_finds_a_way_is_kept(monkeypatch, answered, tmp_path):
    answered(Undecided("too narrow", SearchReport(7)))
    path = np.zeros((2, 5))
    monkeypatch.setattr(answering, "search_by_peers", lambda *given: Searched(("trees",), path, 0.2))
    record = ask(5, SMALL, tmp_path)
    assert (record.peer, record.peer_found, record.peer_seconds) == ("trees", True, 0.2)
    kept = json.loads((tmp_path / "3_5" / "found.json").read_text())
    assert kept["path"] == path.tolist()
    assert kept["record"]["reason"] == record.reason == "too narrow"


def summary(*records):
    """How questions were answered, by groups."""
    return summarise_questions(table_of(records, QuestionRecord))


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({}, 0),
        ({"verified": False}, 1),
        ({"sampled_margin": 0.0}, 1),
        ({"sampled_margin": 0.0, "verified": False}, 1),
        ({"verdict": "failed", "verified": False}, 1),
        ({"verdict": "infeasible", "peer_found": True}, 1),
        ({"verdict": "infeasible", "sampled_margin": nan}, 0),
        ({"verdict": "undecided", "verified": False, "peer_found": True}, 0),
    ],
)
def test_what_makes_an_answer_wrong_and_it_counts_once(changes, wrong):
    record = replace(RIGHT, **changes)
    assert record.is_wrong == bool(wrong)
    every = summary(RIGHT, record)[-1]
    assert (every.count, every.wrong) == (2, wrong)


def test_a_question_whose_process_was_lost_counts_and_has_no_time():
    lost = QuestionRecord(1, 1, "", 0, 0, "", "failed", reason="no result within 60 s")
    groups = summary(RIGHT, lost)
    every = groups[-1]
    assert (every.count, every.wrong, every.seconds.count, every.seconds.largest) == (2, 1, 1, 1.5)
    assert {one.axis for one in groups if one.count == 1} == {"floor", "robots", "joints", "corners"}
    (every,) = summary(lost)
    assert every.cells()[-3:] == ("", "", "")


@pytest.fixture(scope="module")
def asked(tmp_path_factory) -> Study:
    path = tmp_path_factory.mktemp("study") / "asked.study.yaml"
    path.write_text(FILE)
    return load_study(path)


def written(folder, batch, **changes):
    """Write right answers of a batch."""
    record = replace(RIGHT, **changes)
    folder.write(batch, [replace(record, question=number) for number in range(batch.first, batch.stop)])


@pytest.mark.slow
def test_a_process_answers_as_this_one_does(asked, tmp_path):
    folder = CampaignFolder(tmp_path)
    folder.campaign.write_text(FILE)
    batches = batches_of(asked, folder)
    last = batches[LAST // 2]
    assert make_batch(Order(str(asked.path), str(tmp_path), last, 600.0))
    assert folder.missing(batches) == list(batches[:-1])
    assert folder.costs(batches)[0]["sources"] == source_digest()
    assert folder.by_other_sources(batches) == 0
    (row,) = folder.records(batches, QuestionRecord).to_pylist()
    here = asdict(ask(LAST, asked.questions))
    differing = {name for name in row if str(row[name]) != str(here[name])}
    assert all(name.endswith(MEASURED) for name in differing)
    assert (row["verdict"], row["verified"]) == ("plan", True)
    assert not (folder.path / CASES).exists()


def test_a_wrong_answer_is_counted_and_fails_the_command(asked, tmp_path):
    folder, command = CampaignFolder(tmp_path), ["study", str(asked.path), "--out", str(tmp_path), "--json"]
    for batch in batches_of(asked, folder):
        written(folder, batch)
    assert CliRunner().invoke(app, command).exit_code == 0
    written(folder, batch, verified=False)
    failed = CliRunner().invoke(app, command)
    assert failed.exit_code == 1
    every = json.loads(failed.stdout)["questions"][-1]
    assert (every["count"], every["plans"], every["wrong"]) == (5, 5, 1)
