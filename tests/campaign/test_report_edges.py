"""What a report says of results that are few, equal, lost or made twice."""

import json
from math import inf, nan

import numpy as np
import pyarrow as pa
import pytest

from coop_drake.campaign.records import QuestionRecord, RunRecord, table_of
from coop_drake.campaign.report import make_report
from coop_drake.campaign.report.columns import Runs
from coop_drake.campaign.report.distributions import distribution
from coop_drake.campaign.report.figures import breaking_svg, distributions_svg, growth_svg, searches_svg
from coop_drake.campaign.report.influences import influences
from coop_drake.campaign.report.page import headline, render_page, verdict
from coop_drake.campaign.report.rates import loss_rate
from coop_drake.campaign.report.searches import summarise_searches
from coop_drake.campaign.search import BreakingPoint, Finding
from tests.support.campaign_table import run_table


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


def test_a_report_says_that_results_are_missing():
    report = make_report("begun", run_table(20), missing=3)
    assert headline(report).endswith("The campaign is not complete: 3 batches are missing.")
    assert verdict(report) == "some"
    assert verdict(make_report("lost", run_table(20, lost=(1,)), missing=3)) == "bad"
    nothing = make_report("nothing", missing=1)
    assert (headline(nothing), verdict(nothing)) == (
        "The campaign is not complete: 1 batch is missing.", "some",
    )  # fmt: skip


def test_an_answer_that_is_wrong_for_two_reasons_counts_once():
    record = QuestionRecord(0, 0, "room", 2, 2, "bar", "plan", 1.5, verified=False, sampled_margin=-0.1)
    every = make_report("questions", questions=table_of([record], QuestionRecord)).questions[-1]
    assert (every.refused, every.contact, every.wrong) == (1, 1, 1)


def test_questions_whose_processes_were_all_lost_make_a_page_without_times():
    lost = [QuestionRecord(k, k, "", 0, 0, "", "failed") for k in range(2)]
    report = make_report("questions", questions=table_of(lost, QuestionRecord))
    (every,) = report.questions
    assert every.cells()[-3:] == ("", "", "")
    page = render_page(report, replay)
    assert "nan" not in page
    assert "<svg" not in page
    assert np.isnan(every.seconds.median)


def test_a_run_lost_inside_what_is_certified_is_bad():
    good = BreakingPoint("base", "drake", "lag", 0.1, 4.0, 4.5, 5, "left")
    inside = BreakingPoint("tight", "drake", "all", 1.0, 0.5, 0.625, 5, "left")
    assert verdict(make_report("good", breaking=[good])) == "good"
    report = make_report("inside", breaking=[good, inside])
    assert headline(report) == "A run was lost at 0.62 times what is certified (all, tight)."
    assert verdict(report) == "bad"
    assert '<td class="n some">0.5</td>' in render_page(report, replay)


def test_a_bisection_whose_process_was_lost_is_not_determined_and_bad():
    good = BreakingPoint("base", "drake", "lag", 0.1, 4.0, inf, 5, "")
    lost = BreakingPoint("base", "drake", "model_error", nan, 0.0, inf, 5, "no result within 60 s")
    for points in ([good, lost], [lost]):
        report = make_report("lost", breaking=points)
        assert headline(report) == "1 breaking point is not determined (model error, base)."
        assert verdict(report) == "bad"
        page = render_page(report, replay)
        assert page.count(">not determined</td>") == 4
        assert ">nan" not in page
        assert ">inf" not in page
        assert "0 or more" not in page


def test_what_bisections_found_bad_is_told_with_the_rate_of_lost_runs():
    inside = BreakingPoint("tight", "drake", "all", 1.0, 0.0, 0.125, 5, "left")
    report = make_report("runs", run_table(20), breaking=[inside])
    assert headline(report).startswith("None of 20 runs was lost.")
    assert headline(report).endswith("A run was lost at 0.12 times what is certified (all, tight).")
    assert verdict(report) == "bad"


def test_a_run_that_both_tiers_made_is_one_trial():
    table = run_table(60, tiers=("drake", "compiled"), lost=(7,))
    report = make_report("both", table)
    assert (report.rate.lost, report.rate.runs) == (1, 60)
    assert sum(group.rate.runs for group in report.groups) == 120
    paired = pa.concat_tables([run_table(60, tiers=("compiled",)), run_table(10, lost=(3, 4))])
    assert make_report("paired", paired).rate == loss_rate(2, 60)


def test_a_run_that_used_more_than_the_budget_in_both_tiers_counts_once():
    table = run_table(20, tiers=("drake", "compiled"))
    shares = pa.array(np.where(table["run"].to_numpy() == 5, 1.2, 0.4))
    table = table.set_column(table.schema.get_field_index("budget_share"), "budget_share", shares)
    assert make_report("both", table).exceeded == 1


def test_runs_of_the_same_index_in_two_scenarios_are_two_trials():
    table = pa.concat_tables([run_table(10, scenarios=(name,)) for name in ("base", "tight")])
    assert make_report("two", table).rate.runs == 20


def table_of_margins(values, margins):
    """Runs of one scenario with these values of one key and these funnel margins."""
    records = [
        RunRecord(k, "base", "drake", k, json.dumps({"mass_error": value}), True, funnel_margin=margin)
        for k, (value, margin) in enumerate(zip(values, margins, strict=True))
    ]
    return table_of(records, RunRecord)


def test_a_fault_that_takes_margin_to_both_sides_is_found():
    generator = np.random.default_rng(5)
    errors = generator.uniform(-0.2, 0.2, 200)
    margins = 9e-3 - 0.01 * np.abs(errors) + generator.normal(0.0, 2e-4, 200)
    report = make_report("symmetric", table_of_margins(errors, margins))
    (found,) = report.influences
    assert found.clear
    assert found.taken > 1e-3
    assert "no\nclear effect, or too few runs" in render_page(report, replay)


def test_noise_is_no_clear_effect():
    generator = np.random.default_rng(5)
    table = table_of_margins(generator.uniform(-0.2, 0.2, 200), generator.normal(9e-3, 2e-4, 200))
    (found,) = make_report("noise", table).influences
    assert not found.clear


@pytest.mark.parametrize("steps", [0, 1, 3, 31, 119])
def test_values_that_differ_by_rounding_fill_one_bin(steps):
    value = 0.0123
    values = np.array([value, value + steps * np.spacing(value), value])
    found = distribution(values)
    assert max(found.heights) == sum(found.heights) == 3
    assert "svg" in distributions_svg(make_report("equal", table_of_margins(values, values)).groups)
    assert max(distribution(np.array([value, 1.001 * value])).heights) == 1


def test_a_clear_influence_that_moves_no_median_makes_a_page():
    values = np.linspace(0.0, 1.0, 500)
    spread = np.where(np.arange(500) % 100 < 45, np.where(values < 0.2, -1e-3, 1e-3), 0.0)
    report = make_report("medians", table_of_margins(values, 9e-3 + spread))
    (found,) = report.influences
    assert (found.clear, found.taken) == (True, 0.0)
    assert "--depth: 0%" in render_page(report, replay)


def test_one_array_is_made_for_each_key_that_varies(monkeypatch):
    made, full = [], np.full
    monkeypatch.setattr(np, "full", lambda *args, **named: made.append(args) or full(*args, **named))
    influences(Runs(run_table(100)))
    keys, margins = 2, 4
    assert sum(args[0] == 100 for args in made) == keys + margins


def find(seed, before, worst, arrived=True, reason="", margin="funnel_margin", runs=10):
    return Finding("base", "compiled", seed, runs, margin, before, worst, arrived, reason)


def test_searches_that_could_not_be_made_hide_no_loss():
    crashed = find(1, nan, nan, arrived=False, reason="no result within 60 s", runs=0)
    lost = find(2, 9e-3, -1e-3, arrived=False, reason="left the funnel")
    kept = find(3, 7e-3, 5e-3)
    (row,) = summarise_searches([crashed, lost, kept])
    assert (row.searches, row.failed, row.lost, row.worst) == (3, 1, 1, lost)
    assert (row.before, row.typical) == (pytest.approx(8e-3), pytest.approx(2e-3))
    report = make_report("searches", findings=[crashed, lost, kept])
    assert headline(report) == (
        "1 of 2 searches, with 20 runs, found a run that is lost. 1 search could not be made."
    )
    assert verdict(report) == "bad"
    assert "lost: left the funnel" in render_page(report, replay)


def test_a_lost_run_that_does_not_tell_its_margin_is_a_loss():
    lost = find(1, 0.4, nan, arrived=False, reason="left the funnel", margin="budget_share")
    beyond = find(2, nan, 1.2, margin="budget_share")
    unknown = find(3, nan, nan, margin="budget_share")
    for order in ([lost, beyond, unknown], [unknown, beyond, lost]):
        (row,) = summarise_searches(order)
        assert (row.failed, row.lost, row.worst, row.before, row.typical) == (0, 1, lost, 0.4, 1.2)
        assert headline(make_report("lost", findings=order)) == (
            "1 of 3 searches, with 30 runs, found a run that is lost. "
            "1 search used more than the budget states, up to 120 % of it."
        )
    assert summarise_searches([unknown, beyond])[0].worst == beyond


@pytest.mark.parametrize("margin", ["funnel_margin", "budget_share"])
def test_searches_of_which_none_could_be_made_make_a_page(margin):
    crashed = [find(k, nan, nan, arrived=False, reason="ended", margin=margin, runs=0) for k in range(2)]
    (row,) = summarise_searches(crashed)
    assert (row.failed, row.lost) == (2, 0)
    report = make_report("searches", findings=crashed)
    assert headline(report) == "2 searches could not be made."
    assert verdict(report) == "bad"
    page = render_page(report, replay)
    assert "could not be made: ended" in page
    assert ">nan" not in page


def test_names_with_dollars_are_no_formulas():
    name = r"cost $\frac$"
    point = BreakingPoint(name, "drake", "lag", 0.1, 4.0, 4.5, 5, "left")
    found = Finding(name, "drake", 1, 10, "funnel_margin", 9e-3, 5e-3, True)
    asked = QuestionRecord(0, 0, name, 2, 2, "bar", "plan", 1.5, verified=True)
    runs = run_table(10, scenarios=(name,))
    questions = table_of([asked], QuestionRecord)
    report = make_report(name, runs, questions, findings=[found], breaking=[point])
    for figure in (
        distributions_svg(report.groups),
        breaking_svg(report.breaking),
        searches_svg(summarise_searches(report.findings)),
        growth_svg(report.questions),
    ):
        assert name in figure
