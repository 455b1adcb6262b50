"""What the digest of a plan sees: which model file says what, and what the file of a budget says."""

from __future__ import annotations

import pytest
import yaml
from typer.testing import CliRunner

from benchmarks.app import app
from benchmarks.searches.searching import Searching
from benchmarks.study import load_study
from coop_drake.answers.plan_file import plan_digest
from coop_drake.campaign import plans
from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans, _planned, scenario_content
from coop_drake.campaign.records import CampaignFolder
from coop_drake.campaign.variation import Variation
from coop_drake.scenario.load import load_scenario
from tests.support.cli import invoke
from tests.support.edited_scenario import exchanged
from tests.support.scenarios import MODELS, ROOM, write_scenario

OWN = ("long_blue.sdf", "long_orange.sdf")


def team(folder):
    """A scenario whose robots have models of their own, in a folder beside it."""
    (folder / "own").mkdir(parents=True)
    directives = [dict(one) for one in ROOM["directives"]]
    for index, name in enumerate(OWN):
        model = exchanged((MODELS / name).read_text(), ("<mass>6</mass>", f"<mass>{6 + index}</mass>"))
        (folder / "own" / name).write_text(model)
        model = directives[1 + index]["add_model"]
        directives[1 + index] = {"add_model": {**model, "file": f"own/{name}"}}
    return write_scenario(folder / "room.scenario.yaml", directives=directives)


def test_files_that_change_places_change_the_digest_and_another_folder_does_not(tmp_path):
    here, there = (scenario_content(load_scenario(team(tmp_path / name))) for name in ("here", "there"))
    assert here == there
    first, second = (tmp_path / "there" / "own" / name for name in OWN)
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)
    swapped = scenario_content(load_scenario(tmp_path / "there" / "room.scenario.yaml"))
    assert swapped["scenario"] == here["scenario"]
    assert swapped["models"] != here["models"]


def test_a_plan_of_other_sources_or_models_is_made_anew(tmp_path, monkeypatch):
    team(tmp_path)
    file = tmp_path / "room.campaign.yaml"
    file.write_text(yaml.safe_dump({"runs": {"scenarios": ["room.scenario.yaml"], "count": 1}}))
    made = []

    def planned(scenario, *_):
        made.append(scenario)
        return plan

    plan = _planned(load_scenario(tmp_path / "room.scenario.yaml"), None, None)
    monkeypatch.setattr(plans, "_planned", planned)

    def ask():
        variation = Variation(load_campaign(file))
        assert plan_digest(Plans(variation, tmp_path / "plans").plan_of(variation.run(0))) == plan_digest(
            plan
        )
        return len(made)

    assert [ask(), ask()] == [1, 1]
    monkeypatch.setattr(plans, "source_digest", lambda: "other sources")
    assert ask() == 2
    model = tmp_path / "own" / OWN[0]
    model.write_text(exchanged(model.read_text(), ("<mass>6</mass>", "<mass>8</mass>")))
    assert ask() == 3


def test_an_edited_budget_asks_for_another_plan(tmp_path):
    write_scenario(tmp_path / "room.scenario.yaml")
    asked = {"scenarios": ["room.scenario.yaml"], "budget": "own.budget.yaml"}
    file, budget = tmp_path / "room.campaign.yaml", tmp_path / "own.budget.yaml"
    file.write_text(yaml.safe_dump({"runs": {**asked, "count": 1}}))
    study = tmp_path / "room.study.yaml"
    study.write_text(yaml.safe_dump({"searches": asked}))
    campaign, searches, folder = load_campaign(file), load_study(study), CampaignFolder(tmp_path)

    def digests():
        variation = Variation(campaign)
        searching = Searching(searches, folder, "search", 0)
        return Plans(variation, tmp_path).digest_of(variation.run(0)), searching.trials.digest

    budget.write_text("{delay: 0.0}")
    before = digests()
    assert before == digests()
    assert before[0] == before[1]
    budget.write_text("{delay: 0.001}")
    assert before[0] not in digests()
    assert before[1] not in digests()


@pytest.mark.parametrize("section", ["runs", "searches", "breaking"])
def test_a_budget_without_a_file_is_refused_with_its_key(section, tmp_path):
    write_scenario(tmp_path / "room.scenario.yaml")
    asked = {"scenarios": ["room.scenario.yaml"], "budget": "nowhere.yaml"}
    file = tmp_path / "room.campaign.yaml"
    file.write_text(yaml.safe_dump({section: {**asked, "count": 1} if section == "runs" else asked}))
    if section == "runs":
        result = invoke("campaign", "status", file, "--out", tmp_path / "out")
    else:
        result = CliRunner().invoke(app, ["study", str(file), "--status", "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert f"{section}.budget: 'nowhere.yaml' is not allowed" in result.stderr
