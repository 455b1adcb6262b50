import json
from dataclasses import replace
from html.parser import HTMLParser
from math import inf, isnan

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import beta, binom

from coop_drake.campaign.records import QuestionRecord, table_of
from coop_drake.campaign.report import make_report, write_report
from coop_drake.campaign.report.page import headline, render_page, verdict
from coop_drake.campaign.report.rates import loss_rate, percent_up
from coop_drake.campaign.report.searches import summarise_searches
from coop_drake.campaign.search import BreakingPoint, Finding
from tests.support.campaign_table import run_table


def replay(run):
    return f"replay {run.run}"


@pytest.fixture(scope="module")
def both_tiers():
    return make_report("both", run_table(300, tiers=("drake", "compiled"), lost=(7,)))


def test_no_loss_gives_an_upper_bound_with_all_of_the_error_on_one_side():
    rate = loss_rate(0, 10_000)
    assert rate.upper == pytest.approx(1.0 - 0.05**1e-4)
    assert rate.sentence == "None of 10,000 runs was lost. With 95 % confidence, at most 0.03 % of them are."


@pytest.mark.parametrize(("lost", "runs", "confidence"), [(0, 9, 0.9), (1, 20, 0.95), (7, 50, 0.99)])
def test_bounds_of_a_rate_are_those_of_clopper_and_pearson(lost, runs, confidence):
    rate = loss_rate(lost, runs, confidence)
    assert rate.upper == pytest.approx(beta.ppf(confidence, lost + 1, runs - lost), rel=1e-6)


def test_lost_runs_are_told_with_the_share_counted_and_the_bound():
    assert loss_rate(7, 50).sentence.startswith(
        "7 of 50 runs were lost, 14 %. With 95 % confidence, at most 25 %"
    )
    assert loss_rate(1, 20).sentence.startswith("1 of 20 runs was lost, 5 %.")
    assert loss_rate(20, 20).upper == 1.0


@pytest.mark.parametrize("share", [0.002, 0.01, 0.05, 0.0735, 0.1, 0.3, 0.9])
def test_the_true_share_is_not_above_the_bound_as_often_as_it_says(share):
    runs = 40
    bounds = np.array([loss_rate(lost, runs).upper for lost in range(runs + 1)])
    assert binom.pmf(np.arange(runs + 1), runs, share) @ (share <= bounds) >= 0.95


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.0002995, "0.03 %"), (0.0003001, "0.031 %"), (0.1, "10 %"), (0.07, "7 %"), (0.2801, "29 %"),
     (0.985, "99 %"), (0.9901, "99.1 %"), (0.9999, "100 %"), (1.0, "100 %"), (3e-7, "3e-05 %")],
)  # fmt: skip
def test_bounds_are_rounded_up(share, text):
    assert percent_up(share) == text


def test_distributions_are_those_of_the_columns(both_tiers):
    table = run_table(300, tiers=("drake", "compiled"), lost=(7,)).to_pylist()
    for group in both_tiers.groups:
        own = [row for row in table if (row["scenario"], row["tier"]) == (group.scenario, group.tier)]
        margins = np.array([row["funnel_margin"] for row in own])
        times = np.array([row["time"] for row in own if row["arrived"]])
        assert group.measures["funnel_margin"].least == margins.min()
        assert group.measures["time"].median == pytest.approx(np.median(times))
        assert sum(group.measures["time"].heights) == times.size == group.measures["time"].count
        assert group.rate.lost == sum(not row["arrived"] for row in own)
        assert "budget_share" not in group.measures
    assert {group.reasons for group in both_tiers.groups} == {(), (("left the funnel of the angle", 1),)}


def test_the_fault_that_takes_the_margin_is_found_and_no_other(both_tiers):
    clear = {(one.key, one.measure): one for one in both_tiers.influences if one.clear}
    assert list(clear) == [("deployment.mass_error", "funnel_margin")]
    (found,) = clear.values()
    assert found.worst > 0.1
    assert found.chance < 1e-10
    assert found.taken == pytest.approx(0.0075 * (found.values[-1] - found.values[0]), rel=0.1)


def test_tiers_are_compared_run_by_run(both_tiers):
    rows = {(row["run"], row["tier"]): row for row in run_table(300, tiers=("drake", "compiled")).to_pylist()}
    base, tight = both_tiers.agreements
    assert (base.scenario, base.pairs, base.verdicts, tight.verdicts) == ("base", 150, 0, 0)
    differences = [abs(rows[i, "drake"]["time"] - rows[i, "compiled"]["time"]) for i in range(0, 300, 2)]
    assert base.largest["time"] == pytest.approx(max(differences))
    assert make_report("one tier", run_table(10)).agreements == ()


def test_lost_runs_come_first_among_the_worst_and_the_smallest_share_next(both_tiers):
    lost = [run for run in both_tiers.worst if not run.arrived]
    assert [run.run for run in both_tiers.worst[:2]] == [run.run for run in lost] == [7, 7]
    shares = [run.share for run in both_tiers.worst[2:]]
    assert shares == sorted(shares)
    assert len(both_tiers.worst) == 10
    assert all(run.measure == "funnel_margin" for run in both_tiers.worst)


def test_a_run_that_used_more_than_the_budget_states_is_told_first():
    table, share = run_table(60), np.full(60, 0.4)
    column = table.schema.get_field_index("budget_share")
    assert verdict(make_report("inside", table.set_column(column, "budget_share", pa.array(share)))) == "good"
    share[31] = 1.07
    report = make_report("beyond", table.set_column(column, "budget_share", pa.array(share)))
    assert (report.exceeded, report.most_used, report.worst[0].run) == (1, 1.07, 31)
    assert headline(report).endswith("1 run used more than the budget states, up to 107 % of it.")
    assert verdict(report) == "some"
    assert 'class="headline some"' in render_page(report, replay)
    found = Finding("base", "compiled", 1, 10, "budget_share", 0.4, 1.2, arrived=True)
    searched = make_report("searches", findings=[found])
    assert headline(searched).endswith("1 search used more than the budget states, up to 120 % of it.")
    assert verdict(searched) == "some"
    assert verdict(make_report("lost", run_table(60, lost=(3,)))) == "bad"


def test_a_tier_without_a_column_leaves_it_empty():
    table = run_table(30)
    empty = pa.array([float("nan")] * 30)
    for name in ("wall_clearance", "body_clearance"):
        table = table.set_column(table.schema.get_field_index(name), name, empty)
    report = make_report("no clearance", table)
    assert all("wall_clearance" not in group.measures for group in report.groups)
    assert "nan" not in render_page(report, replay)


def questions():
    rows = [("corridor", "plan", True, False), ("corridor", "infeasible", True, True),
            ("corridor", "plan", False, False), ("rooms", "undecided", False, True)]  # fmt: skip
    records = [
        QuestionRecord(i, i, floor, 2 + i % 2, 2, "bar", verdict, 1.0 + i, verified=verified,
                       peer_found=found, corners=12 + i, width_ratio=[0.9, 1.1, 1.1, np.nan][i])
        for i, (floor, verdict, verified, found) in enumerate(rows)
    ]  # fmt: skip
    return table_of(records, QuestionRecord)


def test_refused_answers_and_contradicted_proofs_are_wrong():
    report = make_report("questions", questions=questions())
    corridor, rooms, *_, every = report.questions
    assert (corridor.group, corridor.plans, corridor.infeasible, corridor.wrong) == ("corridor", 2, 1, 2)
    assert (rooms.undecided, rooms.peer_found, rooms.wrong) == (1, 1, 0)
    assert (every.count, every.seconds.largest) == (4, 4.0)
    assert headline(report) == "4 questions: 2 wrong answers, 1 undecided."


def test_plans_with_contact_and_errors_of_the_planner_are_wrong():
    record = QuestionRecord(0, 0, "room", 2, 2, "bar", "plan", 1.0, verified=True, sampled_margin=1e-6)
    touching, failed = replace(record, sampled_margin=0.0), replace(record, verdict="failed", verified=False)
    report = make_report("questions", questions=table_of([record, touching, failed], QuestionRecord))
    assert (report.questions[-1].contact, report.questions[-1].refused, report.questions[-1].wrong) == (
        1,
        1,
        2,
    )


def test_questions_are_grouped_by_what_makes_them_hard():
    report = make_report("questions", questions=questions())
    groups = {(one.axis, one.group): one.count for one in report.questions}
    assert groups == {
        ("floor", "corridor"): 3, ("floor", "rooms"): 1, ("robots", "2"): 2, ("robots", "3"): 2,
        ("joints", "1 to 2"): 4, ("corners", "0 to 12"): 1, ("corners", "13 to 24"): 3,
        ("width", "0.8 to 1"): 1, ("width", "1 to 1.2"): 2, ("all", "all"): 4,
    }  # fmt: skip
    page = render_page(report, replay)
    assert "width 1 to 1.2" in page


def test_searches_of_a_scenario_are_told_together():
    def find(seed, worst, arrived=True, margin="funnel_margin"):
        return Finding("base", "compiled", seed, 10, margin, 9e-3, worst, arrived, "", f"found/{seed}")

    shares = [find(4, 0.5, margin="budget_share"), find(5, 0.9, margin="budget_share")]
    margins, share = summarise_searches([find(1, 5e-3), find(2, 3e-3), find(3, 7e-3), *shares])
    assert (margins.searches, margins.runs, margins.lost, margins.typical) == (3, 30, 0, 5e-3)
    assert margins.worst.file == "found/2"
    assert share.worst.file == "found/5"
    (lost,) = summarise_searches([find(1, 5e-3), find(2, 6e-3, arrived=False)])
    assert (lost.lost, lost.worst.seed) == (1, 2)


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.needed, self.opened = [], []

    def handle_starttag(self, tag, attributes):
        self.opened.append(tag)
        self.needed += [value for name, value in attributes if name in ("src", "href", "data")]


def test_the_page_stands_alone_and_has_every_section(both_tiers, tmp_path):
    found = [Finding("base", "drake", 1, 40, "funnel_margin", 5e-3, 3e-3, True, "", "<found>.yaml")]
    breaking = [BreakingPoint("base", "drake", "mass_error", 0.2, 3.0, inf, 5, "")]
    report = make_report(
        "a < b", run_table(60), questions(), facts=[("seed", "1")], findings=found, breaking=breaking
    )
    page, numbers = write_report(report, tmp_path / "new", replay)
    parser, text = Links(), page.read_text()
    parser.feed(text)
    assert all(link.startswith("#") for link in parser.needed)
    assert "script" not in parser.opened
    assert parser.opened.count("svg") == 5
    assert parser.opened.count("h2") == 8
    assert "a &lt; b" in text
    assert "&lt;found&gt;.yaml" in text
    assert "replay " in text
    read = json.loads(numbers.read_text())
    assert read["rate"]["lost"] == 0
    assert read["breaking"][0]["lost"] is None
    assert len(read["worst"]) == 10


def test_a_report_of_searches_alone_begins_with_what_they_found():
    breaking = [
        BreakingPoint("base", "drake", name, 1.0, kept, 9.0, 5, "left")
        for name, kept in (("lag", 4.0), ("all", 2.0))
    ]
    report = make_report("searches", breaking=breaking)
    assert headline(report) == "No run was lost up to 2 times what is certified (all, base)."
    assert "svg" in render_page(report, replay)
    finds = [Finding("base", "drake", k, 40, "funnel_margin", 5e-3, -1e-3, k > 0, "left") for k in range(3)]
    assert headline(make_report("lost", findings=finds)).startswith("1 of 3 searches, with 120 runs,")
    assert headline(make_report("none", findings=finds[1:])).startswith("None of 2 searches")


def test_the_same_results_give_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        write_report(make_report("same", run_table(40)), tmp_path / name, replay)
    for file in ("report.html", "report.json"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_a_campaign_without_results_says_so():
    report = make_report("nothing", run_table(0))
    assert headline(report) == "There are no results yet."
    assert report.rate is None
    assert "There are no results yet." in render_page(report, replay)
    assert not any(isnan(run.share) for run in report.worst)
