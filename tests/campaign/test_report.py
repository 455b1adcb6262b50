"""The report of a campaign: rates, distributions, worst runs; results that are few, equal or lost."""

import json
from html.parser import HTMLParser
from math import isnan

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import beta

from coop_drake.campaign.records import RunRecord, table_of
from coop_drake.campaign.report import (
    distribution,
    distributions_svg,
    headline,
    loss_rate,
    make_report,
    percent_up,
    render_page,
    verdict,
    write_report,
)


def run_table(count=200, scenarios=("base", "tight"), tiers=("drake",), lost=(), seed=1):
    """Runs whose funnel margins fall by 3 mrad from the smallest mass error to the largest; others are noise.

    ``lost`` are the indices of runs that left their funnel.
    """
    generator = np.random.default_rng(seed)
    records = []
    for index in range(count):
        error, loss = generator.uniform(-0.2, 0.2), generator.uniform(0.0, 0.3)
        scenario = scenarios[index % len(scenarios)]
        for tier in tiers:
            away = index in lost
            funnel = 0.009 - 0.0075 * (error + 0.2) + generator.normal(0.0, 2e-4)
            records.append(
                RunRecord(
                    index, scenario, tier, 1000 + index,
                    json.dumps({"deployment.mass_error": error, "deployment.messages.loss": loss}),
                    not away,
                    "left the funnel of the angle" if away else "",
                    time=generator.normal(16.0, 0.4),
                    steps=4000,
                    funnel_margin=-1e-3 if away else funnel,
                    cell_margin=generator.uniform(0.02, 0.03),
                    wall_clearance=generator.normal(0.1, 0.002),
                    body_clearance=generator.normal(0.2, 0.002),
                    peak_force=generator.normal(180.0, 12.0),
                    peak_torque=generator.normal(40.0, 3.0),
                )
            )  # fmt: skip
    return table_of(records, RunRecord)


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
    assert verdict(make_report("lost", run_table(60, lost=(3,)))) == "bad"


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.needed, self.opened = [], []

    def handle_starttag(self, tag, attributes):
        self.opened.append(tag)
        self.needed += [value for name, value in attributes if name in ("src", "href", "data")]


def test_the_page_stands_alone_and_has_every_section(both_tiers, tmp_path):
    report = make_report("a < b", run_table(60), facts=[("seed", "1")])
    page, numbers = write_report(report, tmp_path / "new", replay)
    parser, text = Links(), page.read_text()
    parser.feed(text)
    assert all(link.startswith("#") for link in parser.needed)
    assert "script" not in parser.opened
    assert parser.opened.count("svg") == 2
    assert parser.opened.count("h2") == 4
    assert "a &lt; b" in text
    assert "replay " in text
    read = json.loads(numbers.read_text())
    assert read["rate"]["lost"] == 0
    assert len(read["worst"]) == 10


def test_a_campaign_without_results_says_so():
    report = make_report("nothing", run_table(0))
    assert headline(report) == "There are no results yet."
    assert report.rate is None
    assert "There are no results yet." in render_page(report, replay)
    assert not any(isnan(run.share) for run in report.worst)


def test_a_report_says_that_results_are_missing():
    report = make_report("begun", run_table(20), missing=3)
    assert headline(report).endswith("The campaign is not complete: 3 batches are missing.")
    assert verdict(report) == "some"
    assert verdict(make_report("lost", run_table(20, lost=(1,)), missing=3)) == "bad"
    nothing = make_report("nothing", missing=1)
    assert (headline(nothing), verdict(nothing)) == (
        "The campaign is not complete: 1 batch is missing.", "some",
    )  # fmt: skip


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


def table_of_margins(values, margins):
    """Runs of one scenario with these values of one key and these funnel margins."""
    records = [
        RunRecord(k, "base", "drake", k, json.dumps({"mass_error": value}), True, funnel_margin=margin)
        for k, (value, margin) in enumerate(zip(values, margins, strict=True))
    ]
    return table_of(records, RunRecord)


@pytest.mark.parametrize("steps", [0, 1, 3, 31, 119])
def test_values_that_differ_by_rounding_fill_one_bin(steps):
    value = 0.0123
    values = np.array([value, value + steps * np.spacing(value), value])
    found = distribution(values)
    assert max(found.heights) == sum(found.heights) == 3
    assert "svg" in distributions_svg(make_report("equal", table_of_margins(values, values)).groups)
    assert max(distribution(np.array([value, 1.001 * value])).heights) == 1


def test_names_with_dollars_are_no_formulas():
    name = r"cost $\frac$"
    assert name in distributions_svg(make_report(name, run_table(10, scenarios=(name,))).groups)
