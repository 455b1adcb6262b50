"""Questions of a study: in batches that do not depend on each other, answered by a process of its own."""

import json
from dataclasses import asdict, replace

import pytest
from typer.testing import CliRunner

from benchmarks.app import app
from benchmarks.questions.answering import CASES, MEASURED, QuestionRecord, ask, question_batches
from benchmarks.questions.settings import QuestionSettings
from benchmarks.study import Study, batches_of, load_study
from coop_drake.campaign.execution import Order, make_batch
from coop_drake.campaign.plans import source_digest
from coop_drake.campaign.records import CampaignFolder
from coop_drake.errors import ScenarioError

FILE = """
questions: {count: 5, seeds: [3], robots: [2], most_joints: 1, floors: [room], batch: 2, peer_time: 0.0}
"""
LAST = 4
"""The only question of the last batch."""


@pytest.fixture(scope="module")
def asked(tmp_path_factory) -> Study:
    path = tmp_path_factory.mktemp("study") / "asked.study.yaml"
    path.write_text(FILE)
    return load_study(path)


def test_more_questions_and_other_floors_change_only_the_batches_that_they_concern():
    asked = QuestionSettings(count=5, batch=2)
    few, many = list(question_batches(asked)), list(question_batches(replace(asked, count=8)))
    assert [(one.first, one.stop) for one in few] == [(0, 2), (2, 4), (4, 5)]
    assert [one.digest for one in few[:2]] == [one.digest for one in many[:2]]
    assert few[2].digest != many[2].digest
    others = {one.digest for one in question_batches(replace(asked, floors=("door",)))}
    assert others.isdisjoint(one.digest for one in few)


@pytest.mark.slow
def test_a_process_answers_as_this_one_does(asked, tmp_path):
    folder = CampaignFolder(tmp_path)
    folder.campaign.write_text(FILE)
    batches = batches_of(asked, folder)
    assert {one.tier for one in batches} == {"planner"}
    last = batches[LAST // 2]
    assert make_batch(Order(str(asked.path), str(tmp_path), last, 600.0))
    assert folder.missing(batches) == list(batches[:-1])
    assert folder.costs(batches)[0]["sources"] == source_digest()
    assert folder.by_other_sources(batches) == 0
    (row,) = folder.records(batches, QuestionRecord).to_pylist()
    here = asdict(ask(LAST, asked.questions))
    differing = {name for name in row if str(row[name]) != str(here[name])}
    assert all(name.endswith(MEASURED) for name in differing)
    assert row["verdict"] == "plan"
    assert row["verified"]
    assert not (folder.path / CASES).exists()


def test_a_wrong_answer_is_counted_and_fails_the_command(asked, tmp_path):
    folder, command = CampaignFolder(tmp_path), [str(asked.path), "--out", str(tmp_path), "--json"]
    right = QuestionRecord(0, 3, "room", 2, 2, "bar", "plan", 1.0, verified=True, sampled_margin=1e-6)
    for batch in batches_of(asked, folder):
        folder.write(batch, [replace(right, question=number) for number in range(batch.first, batch.stop)])
    assert CliRunner().invoke(app, ["study", *command]).exit_code == 0
    folder.write(batch, [replace(right, question=LAST, verified=False)])
    failed = CliRunner().invoke(app, ["study", *command])
    assert failed.exit_code == 1
    every = json.loads(failed.stdout)["questions"][-1]
    assert (every["count"], every["plans"], every["wrong"]) == (5, 5, 1)


def test_batches_that_other_sources_made_are_counted(asked, tmp_path):
    folder, options = CampaignFolder(tmp_path), [str(asked.path), "--out", str(tmp_path), "--json"]
    made = QuestionRecord(0, 3, "room", 2, 2, "bar", "plan", 1.0, verified=True, sampled_margin=1e-6)
    first, second, *_ = batches_of(asked, folder)
    for batch, sources in ((first, source_digest()), (second, "0" * 64)):
        folder.write(batch, [replace(made, question=number) for number in range(batch.first, batch.stop)])
        folder.note(batch, {"runs": 1, "cpu_seconds": 1.0, "sources": sources})
    status = CliRunner().invoke(app, ["study", "--status", *options])
    assert json.loads(status.stdout)["batches_by_other_sources"] == 1
    shown = CliRunner().invoke(app, ["study", "--status", *options[:-1]], terminal_width=80).stdout
    assert "corners 0 to 12" in shown
    assert "…" not in shown  # All columns fit.


def test_a_question_is_written_as_a_scenario(asked, tmp_path):
    done = CliRunner().invoke(app, ["question", str(asked.path), str(LAST), "--out", str(tmp_path)])
    assert done.exit_code == 0
    assert (tmp_path / "drawn" / "4" / "question_3_4.scenario.yaml").exists()


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("questions: {floors: [cave]}", "questions.floors"),
        ("questions: {robots: [1]}", "questions.robots"),
        ("questions: {seeds: []}", "questions.seeds"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, text, key):
    path = tmp_path / "wrong.study.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=key):
        load_study(path)
