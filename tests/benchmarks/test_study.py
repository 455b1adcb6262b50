"""What a study says of questions, searches and bisections, also where processes were lost."""

from dataclasses import replace
from math import inf, isnan, nan

import numpy as np
import pytest

from benchmarks.questions.answering import QuestionRecord
from benchmarks.questions.summary import summarise_questions
from benchmarks.searches.findings import (
    BreakingPoint,
    Finding,
    ends_shown,
    multiple_shown,
    summarise_searches,
)
from benchmarks.study import Results
from coop_drake.campaign.records import table_of


def summary(*records):
    """How questions were answered, by groups."""
    return summarise_questions(table_of(records, QuestionRecord))


def headline(*, findings=(), points=()):
    return Results(findings=tuple(findings), points=tuple(points)).headline


ANSWERED = QuestionRecord(0, 0, "room", 2, 2, "bar", "plan", 1.5, verified=True, sampled_margin=1e-6)


@pytest.fixture
def questions():
    rows = [("corridor", "plan", True, False), ("corridor", "infeasible", True, True),
            ("corridor", "plan", False, False), ("rooms", "undecided", False, True)]  # fmt: skip
    return summary(
        *(
            QuestionRecord(i, i, floor, 2 + i % 2, 2, "bar", verdict, 1.0 + i, verified=verified,
                           peer_found=found, corners=12 + i, width_ratio=[0.9, 1.1, 1.1, np.nan][i])
            for i, (floor, verdict, verified, found) in enumerate(rows)
        )
    )  # fmt: skip


def test_refused_answers_and_contradicted_proofs_are_wrong(questions):
    corridor, rooms, *_, every = questions
    assert (corridor.group, corridor.plans, corridor.infeasible, corridor.wrong) == ("corridor", 2, 1, 2)
    assert (rooms.undecided, rooms.peer_found, rooms.wrong) == (1, 1, 0)
    assert (every.count, every.seconds.largest) == (4, 4.0)
    results = Results(questions, missing=3)
    said = "4 questions: 2 wrong answers, 1 undecided. The study is not complete: 3 batches are missing."
    assert (results.headline, results.good) == (said, False)


def test_questions_are_grouped_by_what_makes_them_hard(questions):
    assert {(one.axis, one.group): one.count for one in questions} == {
        ("floor", "corridor"): 3, ("floor", "rooms"): 1, ("robots", "2"): 2, ("robots", "3"): 2,
        ("joints", "1 to 2"): 4, ("corners", "0 to 12"): 1, ("corners", "13 to 24"): 3,
        ("width", "0.8 to 1"): 1, ("width", "1 to 1.2"): 2, ("all", "all"): 4,
    }  # fmt: skip


def test_plans_with_contact_and_errors_of_the_planner_are_wrong_once_each():
    touching, failed = (
        replace(ANSWERED, sampled_margin=0.0), replace(ANSWERED, verdict="failed", verified=False),
    )  # fmt: skip
    every = summary(ANSWERED, touching, failed)[-1]
    assert (every.contact, every.refused, every.wrong) == (1, 1, 2)
    both = summary(replace(touching, verified=False))[-1]
    assert (both.refused, both.contact, both.wrong) == (1, 1, 1)


def test_a_question_whose_process_was_lost_counts_and_has_no_time():
    lost = QuestionRecord(1, 1, "", 0, 0, "", "failed", reason="no result within 60 s")
    groups = summary(ANSWERED, lost)
    every = groups[-1]
    assert (every.count, every.wrong, every.seconds.count, every.seconds.largest) == (2, 1, 1, 1.5)
    assert {(one.axis, one.group) for one in groups if one.count == 1} == {
        ("floor", "room"), ("robots", "2"), ("joints", "1 to 2"), ("corners", "0 to 12"),
    }  # fmt: skip
    assert Results(groups).headline == "2 questions: 1 wrong answer, 0 undecided."
    (every,) = summary(lost)
    assert every.cells()[-3:] == ("", "", "")
    assert isnan(every.seconds.median)


def point(scenario="base", departure="lag", certified=0.1, kept=4.0, lost=4.5):
    return BreakingPoint(scenario, "drake", departure, certified, kept, lost, 5, "left")


def test_bisections_tell_the_least_multiple_and_a_loss_inside_what_is_certified():
    good, inside = point(), point("tight", "all", 1.0, 0.5, 0.625)
    assert Results(points=(good,)).good
    assert not Results(points=(good, inside)).good
    assert headline(points=[good, inside]) == "A run was lost at 0.62 times what is certified (all, tight)."
    said = "No run was lost up to 2 times what is certified (all, base)."
    assert headline(points=[good, point(departure="all", kept=2.0)]) == said


def test_a_bisection_whose_process_was_lost_is_not_determined_and_bad():
    lost = point(departure="model_error", certified=nan, kept=0.0, lost=inf)
    for points in ([point(lost=inf), lost], [lost]):
        assert headline(points=points) == "1 breaking point is not determined (model error, base)."
        assert not Results(points=tuple(points)).good
    assert {*ends_shown(lost), multiple_shown(lost)} == {"not determined"}
    assert multiple_shown(point(lost=inf)) == "4 or more"


def find(seed, before, worst, arrived=True, reason="", margin="funnel_margin", runs=10):
    return Finding("base", "compiled", seed, runs, margin, before, worst, arrived, reason, f"found/{seed}")


def test_searches_of_a_scenario_are_told_together():
    shares = [find(4, 0.4, 0.5, margin="budget_share"), find(5, 0.4, 0.9, margin="budget_share")]
    margins, share = summarise_searches(
        [*(find(k, 9e-3, 1e-3 * w) for k, w in ((1, 5), (2, 3), (3, 7))), *shares]
    )
    assert (margins.searches, margins.runs, margins.lost, margins.typical) == (3, 30, 0, 5e-3)
    assert (margins.worst.file, share.worst.file) == ("found/2", "found/5")
    (lost,) = summarise_searches([find(1, 9e-3, 5e-3), find(2, 9e-3, 6e-3, arrived=False)])
    assert (lost.lost, lost.worst.seed) == (1, 2)
    assert headline(findings=shares) == "None of 2 searches, with 20 runs, found a run that is lost."


def test_searches_that_could_not_be_made_hide_no_loss():
    crashed = find(1, nan, nan, arrived=False, reason="no result within 60 s", runs=0)
    lost = find(2, 9e-3, -1e-3, arrived=False, reason="left the funnel")
    kept = find(3, 7e-3, 5e-3)
    (row,) = summarise_searches([crashed, lost, kept])
    assert (row.searches, row.failed, row.lost, row.worst) == (3, 1, 1, lost)
    assert (row.before, row.typical) == (pytest.approx(8e-3), pytest.approx(2e-3))
    assert headline(findings=[crashed, lost, kept]) == (
        "1 of 2 searches, with 20 runs, found a run that is lost. 1 search could not be made."
    )
    assert not Results(findings=(crashed,)).good
    assert headline(findings=[crashed, crashed]) == "2 searches could not be made."


def test_a_lost_run_that_does_not_tell_its_margin_is_a_loss():
    lost = find(1, 0.4, nan, arrived=False, reason="left the funnel", margin="budget_share")
    beyond = find(2, nan, 1.2, margin="budget_share")
    unknown = find(3, nan, nan, margin="budget_share")
    for order in ([lost, beyond, unknown], [unknown, beyond, lost]):
        (row,) = summarise_searches(order)
        assert (row.failed, row.lost, row.worst, row.before, row.typical) == (0, 1, lost, 0.4, 1.2)
        assert headline(findings=order) == (
            "1 of 3 searches, with 30 runs, found a run that is lost. "
            "1 search used more than the budget states, up to 120 % of it."
        )
    assert summarise_searches([unknown, beyond])[0].worst == beyond
