"""Which run stands at an index: drawn from the file and the index alone, and allowed by the scenario."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydrake.common import schema

from coop_drake.campaign import file as distributions
from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ScenarioError

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
