"""Searches and bisections of a study: what they find, that it can be made again, and what is said of it."""

from dataclasses import replace
from math import inf, isfinite, nan
from pathlib import Path

import numpy as np
import pytest
import typer
import yaml

import coop_drake
from benchmarks.campaigns import __main__ as campaigns
from benchmarks.searches.departures import BoundedDepartures, departures_at, largest_multiple, multiplied
from benchmarks.searches.findings import (
    BreakingPoint,
    Finding,
    summarise_searches,
)
from benchmarks.searches.searching import Searching, first_lost, search_worst
from benchmarks.study import Results, load_study, make_study
from coop_drake.campaign import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import CampaignFolder, RunRecord
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ScenarioError
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of
from coop_drake.scenario.budget_file import wave_bounds
from coop_drake.scenario.deployment import Wave, Waves
from tests.support.scenarios import write_scenario

ASKED = {
    "set": {"deployment.preset": "mobile_base"},
    "budget": "all",
    "scenarios": ["room.scenario.yaml"],
}
BROKEN = {**ASKED, "departures": ["angles", "model"], "runs": 2, "halvings": 6, "seed": 5}
WAVES = "deployment.measurements.waves"


@pytest.fixture(scope="module")
def allowed(tmp_path_factory):
    """The departures that the whole budget of a preset allows, and the team."""
    file = tmp_path_factory.mktemp("room") / "room.scenario.yaml"
    scenario = coop_drake.load_scenario(write_scenario(file, deployment={"preset": "mobile_base"}))
    problem = planning_problem(scenario)
    return BoundedDepartures(budget_of("all", scenario, problem), problem.tree), problem.tree


def waves_in(values):
    names = {key.split(".")[3] for key in values if ".waves." in key}
    parts = ("size", "period", "phase")
    return Waves(**{name: Wave(*(values[f"{WAVES}.{name}.{part}"] for part in parts)) for name in names})


def test_departures_reach_the_bounds_of_the_budget_and_never_exceed_them(allowed):
    (bounded, tree), generator = allowed, np.random.default_rng(1)
    budget = bounded.budget
    rates, velocities, places, axes = [], [], [], []
    for _ in range(200):
        values = bounded.values(generator.uniform(size=len(bounded.names)))
        reached = wave_bounds(waves_in(values), tree)
        assert reached.angle == pytest.approx(budget.angle_noise)
        assert reached.position == pytest.approx(budget.position_noise)
        rates.append(reached.rate / budget.rate_noise)
        velocities.append(reached.velocity / budget.velocity_noise)
        assert abs(values["deployment.mass_error"]) <= budget.model_error
        assert 0.0 <= values["deployment.measurements.delay"] <= budget.delay
        assert 0.0 <= values["deployment.messages.delay"] <= budget.report_age
        start = {key.split(".")[-1]: value for key, value in values.items() if "start_offset" in key}
        places.append(np.hypot(start["x"], start["y"]) / budget.position_noise)
        axes.append(np.abs([start["theta"], *start["joints"]]).max() / budget.angle_noise)
        assert len(start["joints"]) == len(tree.joints)
        assert 2.0 * budget.period <= waves_in(values).angle.period <= 4.0
    assert max(places) == pytest.approx(1.0)
    assert 0.9 < max(axes) <= 1.0
    assert max(*rates, *velocities) <= 1.0 + 1e-12
    assert max(np.maximum(rates, velocities)) == pytest.approx(1.0)
    assert values["deployment.measurements.rate_noise"] == values["deployment.messages.loss"] == 0.0


def test_one_departure_acts_alone_at_its_multiple_and_all_errors_together(allowed):
    budget, tree = allowed[0].budget, allowed[1]
    angles = departures_at(budget, tree, "angles", 3.0, 1)
    assert angles[f"{WAVES}.angle.size"] == angles[f"{WAVES}.joints.size"] == pytest.approx(3.0 * 0.0015)
    assert angles["deployment.start_offset.x"] == angles["deployment.start_offset.theta"] == 0.0
    assert angles[f"{WAVES}.turn_rate.size"] == angles["deployment.mass_error"] == 0.0
    assert angles["deployment.measurements.delay"] == budget.delay
    delay = departures_at(budget, tree, "delay", 2.0, 1)
    assert delay["deployment.measurements.delay"] == 2.0 * budget.delay
    assert delay[f"{WAVES}.angle.size"] == budget.angle_noise
    errors = {departures_at(budget, tree, "model", 2.0, seed)["deployment.mass_error"] for seed in range(9)}
    assert errors == {-0.4, 0.4}
    assert largest_multiple(budget, "model", 64.0) == pytest.approx(4.5)
    assert multiplied(budget, "all", 64.0).model_error == 0.9
    rates = [departures_at(budget, tree, "rates", 1.0, seed) for seed in range(5)]
    assert all(np.isfinite(value).all() for values in rates for value in values.values())
    assert isfinite(largest_multiple(budget, "all", 8.0))


def record(margin, arrived=True, **more):
    return RunRecord(0, "base", "drake", 1, "{}", arrived, funnel_margin=margin, **more)


def worst(rule, margin="funnel_margin", evaluations=500, seed=1):
    """The worst of two departures (a, b) in the unit square by a rule that makes a record of each."""
    return search_worst(
        np.full(2, 0.5),
        lambda fractions: {"a": float(fractions[0]), "b": float(fractions[1])},
        lambda values: [rule(x["a"], x["b"]) for x in values],
        margin=margin,
        evaluations=evaluations,
        seed=seed,
    )


def test_a_search_finds_the_worst_departures_and_the_same_ones_again():
    """The margin falls towards departures at (0.8, 0.2), where it is 1 mrad."""

    def bowl(a, b):
        return record(1e-3 + 1e-2 * ((a - 0.8) ** 2 + (b - 0.2) ** 2))

    found, again = (worst(bowl, evaluations=150, seed=3) for _ in range(2))
    assert found == again
    assert found.record.funnel_margin == min(found.margins) == pytest.approx(1e-3, abs=1e-5)
    assert found.values["a"] == pytest.approx(0.8, abs=0.05)
    assert found.margins[0] == pytest.approx(1e-3 + 1e-2 * 0.18)
    assert len(found.margins) == 150


LOST_RUNS = {
    "by the margin of funnels": lambda a, b: record(-1e-4 if a > 0.6 else 0.01 - a / 100.0, a <= 0.6),
    "whose shares are worse in runs that arrive": lambda a, b: record(
        nan, a <= 0.6, budget_share=nan if a > 0.6 else 1.5 + b
    ),
}


@pytest.mark.parametrize("case", LOST_RUNS)
def test_a_lost_run_ends_a_search(case):
    found = worst(LOST_RUNS[case], "budget_share" if "shares" in case else "funnel_margin")
    assert not found.record.arrived
    assert found.values["a"] > 0.6
    assert len(found.margins) < 60
    assert "shares" not in case or found.first.budget_share == 2.0


@pytest.mark.parametrize("edge", [0.3, 1.0, 1.7, 11.3])
def test_bisection_encloses_the_multiple_at_which_runs_are_lost(edge):
    tried = []

    def lost(multiple):
        tried.append(multiple)
        return f"left at {multiple}" if multiple >= edge else ""

    kept, upper, reason = first_lost(lost, halvings=8)
    assert kept < edge <= upper
    assert upper - kept <= max(1.0, edge) / 2**7
    assert reason == f"left at {upper}"
    assert len(tried) == len(set(tried))


def test_where_nothing_is_lost_bisection_says_how_far_it_looked_and_tries_nothing_impossible():
    def lost(multiple):
        assert multiple <= 16.0
        return ""

    assert first_lost(lost, halvings=5, largest=16.0) == (16.0, inf, "")
    assert first_lost(lost, 5, 64.0, lambda multiple: multiple <= 10.0) == (8.0, inf, "")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("searches")
    goal = {"object": {"x": 3.5, "y": 2.0, "theta": 0.0}, "tolerances": {"position": 0.015}}
    write_scenario(folder / "room.scenario.yaml", goal=goal)
    file = folder / "room.study.yaml"
    file.write_text(yaml.safe_dump({"searches": {**ASKED, "evaluations": 2, "seed": 4}, "breaking": BROKEN}))
    return load_study(file)


@pytest.fixture(scope="module")
def searched(study):
    """The one search of the campaign, made in a process of its own."""
    alone = replace(study, breaking=None)
    return alone, make_study(alone, CampaignFolder(study.path.parent / "results"), workers=1)


@pytest.mark.slow
def test_a_search_is_made_once_and_its_worst_run_is_found_again_to_the_last_bit(searched):
    study, outcome = searched
    assert outcome.made == 1
    assert make_study(study, outcome.folder, workers=1).made == 0
    (row,) = outcome.folder.records(outcome.batches, Finding).to_pylist()
    finding, folder = Finding(**row), outcome.folder.path
    assert (finding.scenario, finding.tier, finding.seed, finding.evaluations) == ("room", "drake", 4, 2)
    assert finding.arrived
    assert 0.0 < finding.worst <= finding.before
    again = Variation(load_campaign(folder / finding.file))
    assert again.count == 1
    record = RunMaker(again, Plans(again, folder / "plans"), "drake", folder).record(again.run(0))
    assert (record.funnel_margin, record.arrived) == (finding.worst, True)
    assert len(list((folder / "plans").iterdir())) == 1  # it follows the plan of the search


@pytest.mark.slow
def test_a_breaking_point_is_where_the_first_run_is_lost(study, searched, monkeypatch):
    def record(maker, run):
        size = run.values[f"{WAVES}.angle.size"]
        return replace(maker.begun(run), arrived=size < 0.006, reason="" if size < 0.006 else "left")

    monkeypatch.setattr(RunMaker, "record", record)
    folder = searched[1].folder
    searching = Searching(study, folder, "breaking", 0)
    angles, model = map(searching.record, range(2))
    assert angles.certified == 0.0015
    assert (angles.kept < 4.0 <= angles.lost, angles.lost - angles.kept <= 0.1) == (True, True)
    assert (angles.reason, angles.runs, angles.beyond) == ("left", 2, angles.lost)
    assert (model.departure, model.kept, model.lost, model.beyond) == ("model", 4.0, inf, None)
    delay = {"departures": ("delay",), "largest": 4096.0}  # A delay of more than 10 s is not allowed.
    asked = replace(study, breaking=replace(study.breaking, **delay))
    point = Searching(asked, folder, "breaking", 0).record(0)
    assert (point.kept, point.lost, point.reason) == (512.0, inf, "")
    batches = list(searching.batches())
    folder.write(batches[1], [model])
    assert folder.records(batches, BreakingPoint).to_pylist() == [vars(model)]


@pytest.mark.parametrize(
    ("section", "key"),
    [
        ({"searches": {**ASKED, "scenarios": []}}, "searches.scenarios"),
        ({"searches": {**ASKED, "margin": "time"}}, "searches.margin"),
        ({"breaking": {**BROKEN, "departures": ["wind"]}}, "breaking.departures[0]"),
        ({"breaking": {**BROKEN, "largest": 0.5}}, "breaking.largest"),
        ({"questions": {"floors": ["cave"]}}, "questions.floors[0]"),
        ({"questions": {"robots": [1]}}, "questions.robots[0]"),
        ({"questions": {"seeds": []}}, "questions.seeds"),
    ],
)
def test_wrong_sections_are_refused_with_file_and_key(section, key, tmp_path):
    file = tmp_path / "wrong.study.yaml"
    file.write_text(yaml.safe_dump(section))
    with pytest.raises(ScenarioError) as refused:
        load_study(file)
    assert refused.value.key == key


def test_a_search_needs_a_budget(study, tmp_path):
    asked = replace(study, searches=replace(study.searches, budget=None))
    with pytest.raises(ScenarioError, match="what is certified"):
        _ = Searching(asked, CampaignFolder(tmp_path), "search", 0).trials.budget


def test_every_campaign_of_the_folder_is_made_and_can_be_read_and_no_other(capsys):
    files = Path(campaigns.__file__).parent.glob("*.yaml")
    read = [load_study(file) if ".study." in file.name else load_campaign(file) for file in files]
    assert sorted(campaigns.NAMES) == sorted(one.name for one in read)
    with pytest.raises(typer.Exit) as ended:
        campaigns.main(["runs"])
    assert ended.value.exit_code == 2
    assert "allowed is any of breaking, searches" in capsys.readouterr().err


def find(seed, before, worst, arrived=True, reason="", margin="funnel_margin", runs=10):
    return Finding("base", "compiled", seed, runs, margin, before, worst, arrived, reason, f"found/{seed}")


def headline(*findings):
    return Results(findings=findings).headline


def test_searches_that_could_not_be_made_hide_no_loss():
    crashed = find(1, nan, nan, arrived=False, reason="no result within 60 s", runs=0)
    lost, kept = find(2, 9e-3, -1e-3, arrived=False, reason="left the funnel"), find(3, 7e-3, 5e-3)
    (row,) = summarise_searches([crashed, lost, kept])
    assert (row.searches, row.failed, row.lost, row.worst) == (3, 1, 1, lost)
    assert (row.before, row.typical) == (pytest.approx(8e-3), pytest.approx(2e-3))
    said = "1 of 2 searches, with 20 runs, found a run that is lost. 1 search could not be made."
    assert headline(crashed, lost, kept) == said
    assert not Results(findings=(crashed,)).good


def test_a_lost_run_that_does_not_tell_its_margin_is_a_loss():
    lost = find(1, 0.4, nan, arrived=False, reason="left the funnel", margin="budget_share")
    beyond, unknown = find(2, nan, 1.2, margin="budget_share"), find(3, nan, nan, margin="budget_share")
    for order in ([lost, beyond, unknown], [unknown, beyond, lost]):
        (row,) = summarise_searches(order)
        assert (row.failed, row.lost, row.worst, row.before, row.typical) == (0, 1, lost, 0.4, 1.2)
        assert headline(*order) == (
            "1 of 3 searches, with 30 runs, found a run that is lost. "
            "1 search used more than the budget states, up to 120 % of it."
        )
    assert summarise_searches([unknown, beyond])[0].worst == beyond
