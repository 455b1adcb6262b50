"""Which run stands at an index: drawn from the file and the index alone, and allowed by the scenario."""

from __future__ import annotations

from pathlib import Path

import dask
import pytest
import yaml
from pydrake.common import schema
from typer.testing import CliRunner

from benchmarks.app import app
from benchmarks.searches.searching import Searching
from benchmarks.study import load_study
from coop_drake.answers.plan import plan_digest
from coop_drake.campaign import file as distributions
from coop_drake.campaign import plans
from coop_drake.campaign.execution import client_of
from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans, _planned, scenario_content
from coop_drake.campaign.records import Batch, CampaignFolder, RunRecord
from coop_drake.campaign.variation import Variation
from coop_drake.errors import CoopDrakeError, ScenarioError
from coop_drake.scenario.load import load_scenario
from tests.support.cli import invoke
from tests.support.edited_scenario import exchanged
from tests.support.scenarios import MODELS, ROOM, write_scenario

FILE = """
runs:
  scenarios: [base, elbow]
  count: 4
  seed: 3
  set: {deployment.preset: mobile_base}
  vary:
    deployment.mass_error: !Uniform {min: -0.1, max: 0.1}
    deployment.robots.*.clock_error: !UniformDiscrete {values: [0.0, 0.001]}
    deployment.measurements.position_noise: !Gaussian {mean: 0.0, stddev: 0.001}
  grid:
    deployment.control_rate: [100, 200]
    deployment.floor.slope: [0.0, 0.01, 0.02]
"""


def variation(folder: Path, *changes: tuple[str, str], text: str = FILE) -> Variation:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "some.campaign.yaml"
    path.write_text(text)
    return Variation(load_campaign(path))


@pytest.mark.parametrize("name", ["Deterministic", "Gaussian", "Uniform", "UniformDiscrete"])
def test_distributions_have_the_names_and_keys_of_drakes_schema(name):
    ours, drakes = getattr(distributions, name), getattr(schema, name)
    assert set(ours.__dataclass_fields__) == {field.name for field in drakes.__fields__}


def test_runs_are_numbered_scenario_by_scenario_and_combination_by_combination(tmp_path):
    made = variation(tmp_path)
    made.check()
    runs = [made.run(index) for index in range(made.count)]
    assert made.count == 2 * 2 * 3 * 4
    assert [run.scenario for run in runs] == [0] * 24 + [1] * 24
    points = [(r.values["deployment.control_rate"], r.values["deployment.floor.slope"]) for r in runs[:24:4]]
    assert points == [(rate, slope) for rate in (100, 200) for slope in (0.0, 0.01, 0.02)]
    assert len({run.seed for run in runs}) == made.count
    assert all(abs(run.values["deployment.mass_error"]) <= 0.1 for run in runs)
    assert {run.values["deployment.robots.*.clock_error"] for run in runs} == {0.0, 0.001}
    assert all(run.values["deployment.measurements.position_noise"] >= 0.0 for run in runs)


def test_a_run_depends_on_the_file_and_its_index_alone(tmp_path):
    made = variation(tmp_path)
    again = variation(tmp_path, ("    deployment.mass_error: !Uniform {min: -0.1, max: 0.1}\n", ""))
    for index in (30, 0, 7):
        one, other = made.run(index), again.run(index)
        assert {**one.values} == {
            **other.values,
            "deployment.mass_error": one.values["deployment.mass_error"],
        }
        assert one == variation(tmp_path).run(index)
    assert variation(tmp_path, ("seed: 3", "seed: 4")).run(7).values != made.run(7).values


def test_the_scenario_of_a_run_has_its_values_and_that_of_its_plan_what_a_plan_depends_on(tmp_path):
    change = ("    deployment.floor.slope: [0.0, 0.01, 0.02]", "    start.object.x: [1.5, 1.55]")
    made = variation(tmp_path, change)
    run = made.run(5)
    scenario, planned = made.scenario_of(run), made.scenario_to_plan(run)
    deployment = scenario.deployment
    assert deployment.mass_error == run.values["deployment.mass_error"]
    assert deployment.robots["*"].clock_error == run.values["deployment.robots.*.clock_error"]
    assert deployment.seed == run.seed
    assert deployment.actuators.base_force == 650.0  # of the preset that is set
    assert scenario.start.object.x == planned.start.object.x == 1.55
    assert planned.deployment.mass_error == 0.2
    assert made.planned_values(run) == {"start.object.x": 1.55}


@pytest.mark.parametrize(
    ("change", "key", "allowed"),
    [
        (
            ("mass_error: !Uniform {min: -0.1", "mass_error: !Uniform {min: -1"),
            "vary.deployment.mass_error",
            "-0.9",
        ),
        (("deployment.mass_error", "deployment.mass_eror"), "deployment.mass_eror", "mass_error"),
        (("deployment.mass_error", "deploymen.mass_error"), "vary.deploymen.mass_error", "deployment"),
        (("[100, 200]", "[100, fast]"), "grid.deployment.control_rate", "number"),
        (("preset: mobile_base", "preset: boat"), "set.deployment.preset", "mobile_base"),
        (("robots.*", "robots.robot_7"), "deployment.robots.robot_7", "robot_0"),
        (("floor.slope", "pushes[2].time"), "grid.deployment.pushes[2].time", "no list"),
        (("seed: 3", "seed: -3"), "seed", "zero or a positive whole number"),
        (("!Uniform {min: -0.1, max: 0.1}", "!Uniform {min: 1, max: 0}"), "max", "at least min"),
        (("!Uniform", "!Even"), "vary.deployment.mass_error", "!Gaussian"),
        (("scenarios: [base, elbow]", "scenarios: [nowhere]"), "the file", "shipped scenario"),
        (("count: 4", "count: 0"), "count", "at least 1"),
    ],
)
def test_what_a_scenario_does_not_allow_is_refused_before_anything_runs(tmp_path, change, key, allowed):
    with pytest.raises(ScenarioError) as caught:
        variation(tmp_path, change).check()
    assert key in caught.value.key
    assert allowed in caught.value.allowed


def test_an_index_beyond_the_runs_and_a_file_without_sections_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match="0 to 47"):
        variation(tmp_path).run(48)
    with pytest.raises(ScenarioError, match=r"runs.*this key is required"):
        variation(tmp_path, text="{}")


# What the digest of a plan sees: which model file says what, and what the file of a budget says.

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
    passing = {"gains.selected": None}
    asked = {"scenarios": ["room.scenario.yaml"], "budget": "own.budget.yaml", "set": passing}
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


# Results that are damaged are named, and the cluster of a campaign has the settings that are documented.


@pytest.fixture
def folder_and_batch(tmp_path):
    folder, batch = CampaignFolder(tmp_path), Batch(0, "compiled", 0, 2, "0" * 64)
    run = RunRecord(0, "base", "compiled", 1, "{}", False, "left its cell")
    folder.write(batch, [run, run])
    return folder, batch


def test_a_file_that_is_damaged_inside_is_named_with_what_to_do(folder_and_batch):
    folder, batch = folder_and_batch
    file = folder.path / batch.file
    content = bytearray(file.read_bytes())
    content[4:200] = bytes(196)  # The end, which says how many rows there are, is whole.
    file.write_bytes(content)
    assert folder.has(batch)
    with pytest.raises(CoopDrakeError, match=r"0\.parquet is damaged \(.*\); remove it, and"):
        folder.table([batch])


def test_a_file_without_its_end_counts_as_missing(folder_and_batch):
    folder, batch = folder_and_batch
    file = folder.path / batch.file
    file.write_bytes(file.read_bytes()[:-20])
    assert folder.missing([batch]) == [batch]


def test_costs_that_cannot_be_read_are_not_counted(folder_and_batch):
    folder, batch = folder_and_batch
    folder.note(batch, {"runs": 2, "cpu_seconds": 1.0})
    assert folder.cpu_seconds([batch]) == 0.5
    (folder.path / batch.costs).write_text("")
    assert folder.costs([batch]) == []


@pytest.fixture(scope="module")
def client():
    with client_of(1, None) as client:
        yield client


def test_a_silent_worker_is_given_up_in_a_minute_and_a_batch_is_tried_a_hundred_times_more(client):
    kept = client.run_on_scheduler(
        lambda dask_scheduler: (
            dask_scheduler.worker_ttl,
            dask_scheduler.periodic_callbacks["worker-ttl"].callback_time,
            dask_scheduler.allowed_failures,
        )
    )
    assert kept == (30.0, 30_000.0, 100)


def test_workers_do_not_measure_themselves_at_short_intervals(client):
    def intervals(dask_worker):
        return {name: callback.callback_time for name, callback in dask_worker.periodic_callbacks.items()}

    (measured,) = client.run(intervals).values()
    assert not {"profile", "profile-cycle"} & measured.keys()
    assert (measured["tick"], measured["monitor"]) == (500.0, 5000.0)


def test_settings_of_the_users_own_stand_above():
    with dask.config.set({"distributed.scheduler.worker-ttl": "7s"}), client_of(1, None) as client:
        assert client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.worker_ttl) == 7.0
