"""Bad input of campaigns is refused with file and key before any run is made, not counted as lost runs."""

from __future__ import annotations

import tracemalloc

import pytest
import yaml
from typer.testing import CliRunner

from benchmarks.app import app
from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

ROOM = {"scenarios": ["room.scenario.yaml"]}


def file_of(folder, **sections):
    """A campaign file beside its scenario."""
    write_scenario(folder / "room.scenario.yaml")
    file = folder / "room.campaign.yaml"
    file.write_text(yaml.safe_dump(sections, sort_keys=False))
    return file


def refused(folder, command="run", *arguments, **sections):
    """What a command says of a campaign, or of a study, that it refuses."""
    file, out = file_of(folder, **sections), ("--out", folder / "out")
    if "runs" in sections:
        result = invoke("campaign", command, file, *arguments, *out)
    else:
        words = ["study", file, *(["--status"] if command == "status" else []), *out]
        result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 2, result.stderr
    assert not list((folder / "out").glob("runs/*"))
    return result.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({}, "compiled loop knows sampled teams alone"),
        (
            {"grid": {"deployment.control_rate": [200, None]}},
            "compiled loop knows sampled teams alone",
        ),
        (
            {
                "set": {"deployment.control_rate": 200},
                "vary": {"deployment.robots.*.sample_offset": {"_tag": "!Uniform", "min": 0, "max": 0.001}},
            },
            "sample_offset",
        ),
        ({"set": {"deployment.control_rate": 200, "control.observer": True}}, "control.observer"),
    ],
)
def test_what_the_compiled_loop_does_not_know_is_no_lost_run(section, said, tmp_path):
    assert said in refused(tmp_path, runs={**ROOM, "count": 2, "tier": "compiled", **section})


def test_a_plan_with_a_budget_is_not_followed_in_continuous_time(tmp_path):
    budget = tmp_path / "own.budget.yaml"
    budget.write_text("{}")
    passing = {"gains.selected": None}
    said = refused(tmp_path, runs={**ROOM, "count": 2, "budget": budget.name, "set": passing})
    assert "deployment.control_rate: None is not allowed" in said


@pytest.mark.parametrize("tier", ["drake", "compiled"])
def test_a_start_in_the_wall_is_a_lost_run_and_not_refused(tier, tmp_path):
    section = {**ROOM, "count": 1, "tier": tier, "set": {"deployment.control_rate": 200}}
    varied = {**section, "grid": {"deployment.start_offset.y": [0.0, 1.9]}}
    variation = Variation(load_campaign(file_of(tmp_path, runs=varied)))
    maker = RunMaker(variation, Plans(variation, tmp_path / "plans"), tier, tmp_path)
    maker.check(0)
    record = maker.record(variation.run(1))
    assert not record.arrived
    assert record.reason


@pytest.mark.parametrize("name", ["searches", "breaking"])
@pytest.mark.parametrize(
    ("key", "value"), [("bogus.key", 1), ("deployment.preset", "no_such"), ("deployment.mass_eror", 0.1)]
)
def test_a_wrong_key_or_value_of_set_is_named_with_its_section(name, key, value, tmp_path):
    said = refused(tmp_path, "status", **{name: {**ROOM, "set": {key: value}}})
    assert "room.campaign.yaml" in said
    assert f"{name}." in said
    assert key in said


@pytest.mark.parametrize("name", ["questions", "searches", "breaking"])
def test_a_study_is_refused_by_the_name_of_its_command(name, tmp_path):
    said = refused(tmp_path, runs={**ROOM, "count": 1}, **{name: {}})
    assert (
        f"{name}: {{}} is not allowed; expected runs alone; others are for `python -m benchmarks study"
        in said
    )


@pytest.mark.parametrize(
    ("sections", "key"),
    [
        ({"runs": {**ROOM, "count": 1, "seed": 2**63}}, "runs.seed"),
        ({"searches": {**ROOM, "seed": 2**63}}, "searches.seed"),
        ({"searches": {**ROOM, "seed": 2**32 - 2, "count": 3}}, "searches.seed"),
        ({"questions": {"count": 1, "seeds": [0, 2**63]}}, "questions.seeds[1]"),
        ({"breaking": {**ROOM, "seed": 999_999, "runs": 3}}, "breaking.seed"),
    ],
)
def test_seeds_that_do_not_fit_are_refused_at_once(sections, key, tmp_path):
    assert f"{key}: " in refused(tmp_path, "status", **sections)


@pytest.mark.parametrize("name", ["runs", "searches", "breaking"])
@pytest.mark.parametrize(
    ("said", "key"),
    [
        ({"deployment.seed": 5}, "set.deployment.seed"),
        ({"deployment": {"seed": 5}}, "set.deployment.seed"),
        ({"deployment": {}, "deployment.mass_error": 0.1}, "set.deployment"),
    ],
)
def test_what_set_says_is_neither_ignored_nor_overwritten(name, said, key, tmp_path):
    section = {**ROOM, "set": said} | ({"count": 1} if name == "runs" else {})
    assert f"{name}.{key}: " in refused(tmp_path, "status", **{name: section})


@pytest.mark.parametrize(
    ("section", "key"),
    [
        (
            {"set": {"deployment.mass_error": 0.1}, "grid": {"deployment": [{}, {"preset": "mobile_base"}]}},
            "runs.grid.deployment: ",
        ),
        (
            {
                "vary": {"goal.object.x": {"_tag": "!Uniform", "min": 3.0, "max": 3.1}},
                "grid": {"goal.object": [{"x": 3.0, "y": 2.0, "theta": 0.0}]},
            },
            "runs.grid.goal.object: ",
        ),
        (
            {"grid": {"workspace.outer[0]": [[0, 0]], "workspace.outer[0][1]": [0]}},
            "grid.workspace.outer[0]: ",
        ),
    ],
)
def test_keys_around_one_another_are_refused(section, key, tmp_path):
    said = refused(tmp_path, "status", runs={**ROOM, "count": 1, **section})
    assert key in said
    assert "overwrite" in said


def test_a_section_that_is_set_may_vary_in_parts(tmp_path):
    grid = {"deployment.mass_error": [0.0, 0.1]}
    section = {**ROOM, "count": 1, "set": {"deployment": {"preset": "mobile_base"}}, "grid": grid}
    variation = Variation(load_campaign(file_of(tmp_path, runs=section)))
    deployment = variation.scenario_of(variation.run(1)).deployment
    assert (deployment.mass_error, deployment.actuators.base_force) == (0.1, 650.0)


@pytest.mark.parametrize(
    "address", ["foo", "", "http://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://127.0.0.1:x", "127.0.0.1:99999"]
)
def test_an_address_that_no_scheduler_has_is_refused(address, tmp_path):
    said = refused(tmp_path, "run", "--scheduler", address, runs={**ROOM, "count": 1})
    assert f"--scheduler: {address!r} is not allowed; expected the address of a Dask scheduler" in said


def test_a_large_grid_takes_no_memory(tmp_path):
    keys = ("mass_error", "measurements.position_noise", "measurements.angle_noise", "actuators.lag")
    sizes = (7, 1000, 900, 1100)
    grid = {
        f"deployment.{key}": [1e-5 * i for i in range(size)] for key, size in zip(keys, sizes, strict=True)
    }
    tracemalloc.start()
    variation = Variation(load_campaign(file_of(tmp_path, runs={**ROOM, "count": 2, "grid": grid})))
    index = 2 * (((5 * 1000 + 999) * 900 + 3) * 1100 + 17) + 1
    values = variation.run(index).values
    assert tracemalloc.get_traced_memory()[1] < 1e8
    tracemalloc.stop()
    assert list(values) == list(grid)
    assert [round(1e5 * value) for value in values.values()] == [5, 999, 3, 17]
    assert variation.count == 2 * 7 * 1000 * 900 * 1100
