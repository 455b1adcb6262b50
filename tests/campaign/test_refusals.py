"""Bad input of campaigns is refused with file and key before any run is made, not counted as lost runs."""

from __future__ import annotations

import pytest
import yaml

from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

ROOM = {"scenarios": ["room.scenario.yaml"]}
CERTIFIED = {**ROOM, "set": {"deployment.preset": "mobile_base"}, "budget": "all", "tier": "compiled"}


def file_of(folder, **sections):
    """A campaign file beside its scenario."""
    write_scenario(folder / "room.scenario.yaml")
    file = folder / "room.campaign.yaml"
    file.write_text(yaml.safe_dump(sections))
    return file


def refused(folder, command="run", *arguments, **sections):
    """What a command says of a campaign that it refuses."""
    result = invoke("campaign", command, file_of(folder, **sections), *arguments, "--out", folder / "out")
    assert result.exit_code == 2, result.stderr
    assert not list((folder / "out").glob("runs/*"))
    return result.stderr


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
    said = refused(tmp_path, runs={**ROOM, "count": 2, "budget": budget.name})
    assert "deployment.control_rate: None is not allowed" in said


def test_searches_and_bisections_of_what_a_loop_does_not_know_are_refused(tmp_path):
    section = {**CERTIFIED, "set": {"deployment.preset": "mobile_base", "control.observer": True}}
    for name in ("searches", "breaking"):
        assert "control.observer" in refused(tmp_path, **{name: section})


@pytest.mark.parametrize("name", ["searches", "breaking"])
@pytest.mark.parametrize(
    ("key", "value"), [("bogus.key", 1), ("deployment.preset", "no_such"), ("deployment.mass_eror", 0.1)]
)
def test_a_wrong_key_or_value_of_set_is_named_with_its_section(name, key, value, tmp_path):
    said = refused(tmp_path, "status", **{name: {**ROOM, "set": {key: value}}})
    assert "room.campaign.yaml" in said
    assert f"{name}." in said
    assert key in said


def test_a_factor_beyond_what_the_model_may_err_is_refused(tmp_path):
    said = refused(tmp_path, searches={**CERTIFIED, "factor": 6.0})
    assert "searches.factor: 6.0 is not allowed" in said
    assert "model_error" in said
    assert "mass_error" in refused(tmp_path, searches={**CERTIFIED, "factor": 4.9})
