"""Searches and bisections of a study, and that what they find can be made again."""

import json
from dataclasses import replace
from math import inf, isfinite

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from benchmarks.app import app
from benchmarks.searches.departures import departures_at, largest_multiple, multiplied
from benchmarks.searches.findings import BreakingPoint, Finding
from benchmarks.searches.searching import Searching, search_batches
from benchmarks.study import load_study, make_study
from coop_drake.campaign import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import CampaignFolder
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ScenarioError
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

pytestmark = pytest.mark.slow

ASKED = {"set": {"deployment.preset": "mobile_base"}, "budget": "all", "scenarios": ["room.scenario.yaml"]}
BROKEN = {**ASKED, "departures": ["angles", "model"], "runs": 2, "halvings": 6, "seed": 5}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("searches")
    write_scenario(folder / "room.scenario.yaml")
    sections = {"searches": {**ASKED, "evaluations": 2, "seed": 4}, "breaking": BROKEN}
    file = folder / "room.study.yaml"
    file.write_text(yaml.safe_dump(sections))
    return load_study(file)


@pytest.fixture(scope="module")
def searched(study):
    """The one search of the campaign, made in a process of its own."""
    alone = replace(study, breaking=None)
    return alone, make_study(alone, CampaignFolder(study.path.parent / "results"), workers=1)


def found(outcome):
    """The one finding of a study."""
    (row,) = outcome.folder.records(outcome.batches, Finding).to_pylist()
    return Finding(**row)


def test_a_search_is_made_once_and_kept(searched):
    study, outcome = searched
    assert outcome.made == 1
    assert make_study(study, outcome.folder, workers=1).made == 0
    finding = found(outcome)
    assert (finding.scenario, finding.tier, finding.seed, finding.evaluations) == ("room", "drake", 4, 2)
    assert finding.arrived
    assert 0.0 < finding.worst <= finding.before


def test_the_worst_run_is_found_again_to_the_last_bit(searched):
    _, outcome = searched
    finding = found(outcome)
    folder = outcome.folder.path
    again = Variation(load_campaign(folder / finding.file))
    assert again.count == 1
    maker = RunMaker(again, Plans(again, folder / "plans"), "drake", folder)
    record = maker.record(again.run(0))
    assert record.funnel_margin == finding.worst
    assert record.arrived
    assert len(list((folder / "plans").iterdir())) == 1  # it follows the plan of the search


def test_what_a_search_finds_by_the_compiled_loop_is_replayed_by_both_loops(study, tmp_path):
    asked = replace(study, searches=replace(study.searches, tier="compiled"), breaking=None)
    finding = Searching(asked, CampaignFolder(tmp_path), "search", 0).record(0)
    file = tmp_path / finding.file
    assert load_campaign(file).runs.tier == "compiled"
    result = invoke("campaign", "replay", file, 0, "--out", tmp_path, "--no-figures", "--json")
    assert result.exit_code == 0, result.stderr
    drake, compiled = json.loads(result.stdout)["tiers"]["funnel_margin"]
    assert compiled == finding.worst
    assert drake == pytest.approx(compiled, abs=5e-4)


def test_a_breaking_point_is_where_the_first_run_is_lost(study, searched, monkeypatch):
    def record(maker, run):
        size = run.values["deployment.measurements.waves.angle.size"]
        return replace(maker.begun(run), arrived=size < 0.006, reason="" if size < 0.006 else "left")

    monkeypatch.setattr(RunMaker, "record", record)
    searching = Searching(study, searched[1].folder, "breaking", 0)
    angles, model = map(searching.record, range(2))
    assert angles.certified == 0.0015
    assert (angles.kept < 4.0 <= angles.lost, angles.lost - angles.kept <= 0.1) == (True, True)
    assert (angles.reason, angles.runs, angles.beyond) == ("left", 2, angles.lost)
    assert (model.departure, model.kept, model.lost, model.beyond) == ("model", 4.0, inf, None)
    assert isinstance(model, BreakingPoint)
    delay = {"departures": ("delay",), "largest": 4096.0}  # A delay of more than 10 s is not allowed.
    asked = replace(study, breaking=replace(study.breaking, **delay))
    (point,) = map(Searching(asked, searched[1].folder, "breaking", 0).record, range(1))
    assert (point.kept, point.lost, point.reason) == (512.0, inf, "")
    batches = list(searching.batches())
    searched[1].folder.write(batches[1], [model])
    assert searched[1].folder.records(batches, BreakingPoint).to_pylist() == [vars(model)]


@pytest.mark.parametrize(("kept", "code"), [(2.0, 0), (0.5, 1)])
def test_a_loss_inside_what_is_certified_makes_the_command_fail(study, tmp_path, kept, code):
    file = study.path.with_name("breaking.study.yaml")
    file.write_text(yaml.safe_dump({"breaking": {**BROKEN, "departures": ["angles"]}}))
    folder = CampaignFolder(tmp_path)
    (batch,) = search_batches(load_study(file), folder)
    folder.write(batch, [BreakingPoint("room", "drake", "angles", 0.0015, kept, kept + 0.1, 2, "left")])
    result = CliRunner().invoke(app, ["study", str(file), "--out", str(tmp_path)])
    assert (result.exit_code, result.stderr) == (code, "")
    assert "angles" in result.stdout


def test_further_searches_leave_the_results_of_earlier_ones_valid(study, tmp_path):
    more = replace(study, searches=replace(study.searches, count=3), breaking=None)
    folder = CampaignFolder(tmp_path)
    before, after = (list(search_batches(one, folder)) for one in (study, more))
    assert [(one.tier, one.first) for one in before] == [("search", 0), ("breaking", 0), ("breaking", 1)]
    assert [(one.first, one.stop) for one in after] == [(0, 1), (1, 2), (2, 3)]
    assert Searching(more, folder, "search", 0).begun(2).seed == 6
    assert after[0].digest == before[0].digest
    other = replace(more, searches=replace(more.searches, evaluations=3))
    assert next(search_batches(other, folder)).digest != before[0].digest
    larger = replace(more, searches=replace(more.searches, batch=2))
    assert [(one.first, one.stop) for one in search_batches(larger, folder)] == [(0, 2), (2, 3)]


def test_one_departure_acts_alone_at_its_multiple_and_all_errors_together(study, searched):
    trials = Searching(study, searched[1].folder, "search", 0).trials
    budget, tree = trials.budget, trials.tree
    waves = "deployment.measurements.waves"
    angles = departures_at(budget, tree, "angles", 3.0, 1)
    assert angles[f"{waves}.angle.size"] == angles[f"{waves}.joints.size"] == pytest.approx(3.0 * 0.0015)
    assert angles["deployment.start_offset.x"] == angles["deployment.start_offset.theta"] == 0.0
    assert angles[f"{waves}.turn_rate.size"] == angles["deployment.mass_error"] == 0.0
    assert angles["deployment.measurements.delay"] == budget.delay
    delay = departures_at(budget, tree, "delay", 2.0, 1)
    assert delay["deployment.measurements.delay"] == 2.0 * budget.delay
    assert delay[f"{waves}.angle.size"] == budget.angle_noise
    errors = {departures_at(budget, tree, "model", 2.0, seed)["deployment.mass_error"] for seed in range(9)}
    assert errors == {-0.4, 0.4}
    assert largest_multiple(budget, "model", 64.0) == pytest.approx(4.5)
    assert multiplied(budget, "all", 64.0).model_error == 0.9
    rates = [departures_at(budget, tree, "rates", 1.0, seed) for seed in range(5)]
    assert all(np.isfinite(value).all() for values in rates for value in values.values())
    assert isfinite(largest_multiple(budget, "all", 8.0))


@pytest.mark.parametrize(
    ("section", "key"),
    [
        ({"searches": {**ASKED, "scenarios": []}}, "searches.scenarios"),
        ({"searches": {**ASKED, "margin": "time"}}, "searches.margin"),
        ({"breaking": {**BROKEN, "departures": ["wind"]}}, "breaking.departures[0]"),
        ({"breaking": {**BROKEN, "largest": 0.5}}, "breaking.largest"),
    ],
)
def test_wrong_sections_are_refused_with_file_and_key(section, key, tmp_path):
    file = tmp_path / "wrong.study.yaml"
    file.write_text(yaml.safe_dump(section))
    with pytest.raises(ScenarioError) as refused:
        load_study(file)
    assert refused.value.key == key


def test_a_search_needs_a_budget(study, searched):
    asked = replace(study, searches=replace(study.searches, budget=None))
    with pytest.raises(ScenarioError, match="what is certified"):
        _ = Searching(asked, searched[1].folder, "search", 0).trials.budget
