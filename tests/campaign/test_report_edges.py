"""What a report says of results that are few, equal, lost or made twice."""

import numpy as np

from coop_drake.campaign.records import QuestionRecord, table_of
from coop_drake.campaign.report import make_report
from coop_drake.campaign.report.page import headline, render_page, verdict


def replay(run):
    return f"replay {run.run}"


def test_a_question_whose_process_was_lost_counts_and_has_no_time():
    answered = QuestionRecord(0, 0, "room", 2, 2, "bar", "plan", 1.5, verified=True, sampled_margin=0.1)
    lost = QuestionRecord(1, 1, "", 0, 0, "", "failed", reason="no result within 60 s")
    report = make_report("questions", questions=table_of([answered, lost], QuestionRecord))
    every = report.questions[-1]
    assert (every.count, every.wrong, every.seconds.count, every.seconds.largest) == (2, 1, 1, 1.5)
    assert {(one.axis, one.group) for one in report.questions if one.count == 1} == {
        ("floor", "room"), ("robots", "2"), ("joints", "1 to 2"), ("corners", "0 to 12"),
    }  # fmt: skip
    assert (headline(report), verdict(report)) == ("2 questions: 1 wrong answer, 0 undecided.", "bad")


def test_questions_whose_processes_were_all_lost_make_a_page_without_times():
    lost = [QuestionRecord(k, k, "", 0, 0, "", "failed") for k in range(2)]
    report = make_report("questions", questions=table_of(lost, QuestionRecord))
    (every,) = report.questions
    assert every.cells()[-3:] == ("", "", "")
    page = render_page(report, replay)
    assert "nan" not in page
    assert "<svg" not in page
    assert np.isnan(every.seconds.median)
