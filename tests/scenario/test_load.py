"""Scenario files become values: shipped and short ones, presets, gain sets in files of their own."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers.problem import PlannerSettings
from coop_drake.errors import ScenarioError
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.scenario import (
    ActuatorLimits,
    Deployment,
    Measurements,
    Scenario,
    SimulatorSettings,
    Tolerances,
    dump_gains,
    dump_scenario,
    load_scenario,
    with_gains,
)
from coop_drake.scenario.document import parse, write
from coop_drake.typed_data import convert_class
from tests.support.cases import CASES
from tests.support.edited_scenario import shipped, write_edited
from tests.support.scenarios import MODELS

SHORT = """
workspace:
  outer: [[0, 0], [4, 0], [4, 4], [0, 4]]
directives:
- add_model: {name: object, file: package://coop_drake_models/object.sdf}
- add_model: {name: left, file: package://coop_drake_models/long_blue.sdf}
- add_model: {name: right, file: package://coop_drake_models/elbow_orange.sdf}
- add_weld: {parent: object::grasp_0, child: left::gripper}
- add_weld: {parent: object::grasp_1, child: right::gripper}
start:
  object: {x: 2, y: 2, theta: 0}
  joints: {left: [0.1], right: [0, 1e-1]}
goal:
  object: {x: 2.5, y: 2, theta: 0}
"""


def test_short_file_gets_defaults(tmp_path):
    path = tmp_path / "short.scenario.yaml"
    path.write_text(SHORT)
    scenario = load_scenario(path)
    assert scenario.name == "short"
    assert scenario.object == "object"
    assert scenario.start.joints == {"left": (0.1,), "right": (0.0, 0.1)}
    assert scenario.goal.tolerances == Tolerances()
    assert scenario.planner == PlannerSettings()
    assert scenario.simulator == SimulatorSettings()
    assert sorted(scenario.gain_sets) == ["scheduled", "table_2"]


@pytest.mark.parametrize("name", sorted(CASES))
def test_written_scenario_reads_back_to_the_same(name, tmp_path):
    scenario = shipped(name)
    copy = tmp_path / "copy.scenario.yaml"
    copy.write_text(dump_scenario(scenario))
    again = load_scenario(copy)
    for field in dataclasses.fields(Scenario):
        if field.name not in ("path", "directives"):
            assert getattr(again, field.name) == getattr(scenario, field.name), field.name
    assert [repr(d.drake) for d in again.directives] == [repr(d.drake) for d in scenario.directives]
    assert dump_scenario(again) == dump_scenario(scenario)


def test_settings_of_every_section_are_read(tmp_path):
    path = write_edited(
        tmp_path,
        (
            "object: object\n",
            "object: object\n"
            "planner: {margin: 0.05, max_slices: 77, strategy: paper}\n"
            "simulator: {max_time: 12, integration_scheme: runge_kutta2}\n"
            "visualization: {wall_height: 1, show_collision: true}\n"
            "gains: {selected: gentle, sets: {gentle: !ScheduledGains {age_phase: 0.5}}}\n",
        ),
        ("angle: 0.02}", "angle: 0.03}\n  joints: {robot_1: [null]}"),
    )
    scenario = load_scenario(path)
    assert scenario.planner == PlannerSettings(margin=0.05, max_slices=77, strategy="paper")
    assert scenario.simulator == SimulatorSettings(max_time=12.0, integration_scheme="runge_kutta2")
    assert scenario.visualization.wall_height == 1.0
    assert scenario.visualization.show_collision
    assert scenario.gain_sets["gentle"] == ScheduledGains(age_phase=0.5)
    assert sorted(scenario.gain_sets) == ["gentle", "scheduled", "table_2"]
    assert scenario.goal.tolerances.angle == 0.03
    assert scenario.goal.joints == {"robot_1": (None,)}


def test_part_of_a_shipped_gain_set_can_be_changed(tmp_path):
    gains = "gains: {sets: {table_2: !FixedGains {damping: 9.0}}}\n"
    path = write_edited(tmp_path, ("object: object\n", f"object: object\n{gains}"))
    assert load_scenario(path).gain_sets["table_2"] == FixedGains(damping=9.0)


MOBILE_BASE = convert_class({"preset": "mobile_base"}, Deployment)


def loaded(tmp_path, deployment):
    path = tmp_path / "real.scenario.yaml"
    path.write_text((MODELS / "base.scenario.yaml").read_text() + f"deployment: {deployment}\n")
    return load_scenario(path)


def test_the_preset_stands_for_its_departures(tmp_path):
    read = loaded(tmp_path, "{preset: mobile_base}").deployment
    assert read == MOBILE_BASE
    assert (read.control_rate, read.mass_error, read.messages.loss) == (200.0, 0.2, 0.2)
    assert (read.measurements.delay, read.measurements.position_noise) == (0.01, 0.001)
    assert (read.actuators.base_force, read.actuators.lag) == (650.0, 0.005)
    assert read.command_age == pytest.approx(0.0195)


def test_keys_beside_the_preset_replace_its_own_and_no_others(tmp_path):
    read = loaded(tmp_path, "{preset: mobile_base, mass_error: -0.2, measurements: {delay: 0}}").deployment
    measurements = replace(MOBILE_BASE.measurements, delay=0.0)
    assert read == replace(MOBILE_BASE, mass_error=-0.2, measurements=measurements)
    unlimited = loaded(tmp_path, "{preset: mobile_base, actuators: {base_force: null}}").deployment
    assert (unlimited.actuators.base_force, unlimited.actuators.lag) == (None, 0.005)


@pytest.mark.parametrize(
    ("deployment", "message"),
    [
        ("{preset: forklift}", "deployment.preset: 'forklift' .* one of mobile_base, or null"),
        ("{preset: 3}", "deployment.preset: 3 .* one of mobile_base, or null"),
        ("{preset: mobile_base, actuators: 5}", "deployment.actuators: 5 .* a mapping"),
        ("{preset: mobile_base, measurements: {lateness: 1}}", "deployment.measurements.lateness"),
    ],
)
def test_what_is_wrong_is_refused_with_its_key(tmp_path, deployment, message):
    with pytest.raises(ScenarioError, match=message):
        loaded(tmp_path, deployment)


@pytest.mark.parametrize(
    ("measurements", "periods"),
    [
        ("{}", 0.0),
        ("{loss: 0.5}", 1.0 + 2.0 * 2.0**0.5),
        ("{late: 0.5, late_by: 1}", 1.0 + 2.0 * 2.0**0.5),
        ("{late: 1, late_by: 0.03}", 6.0),
        ("{loss: 0.2, late: 0.375, late_by: 0.01}", 1.0 + 2.0 * 2.0**0.5),
    ],
)
def test_gains_count_how_much_older_measurements_get_by_losses(tmp_path, measurements, periods):
    """Mean and two standard deviations of the number of missing ones, drawn from their distribution."""
    read = loaded(tmp_path, f"{{control_rate: 200, measurements: {measurements}}}").deployment
    assert read.held_age == pytest.approx(0.005 * periods)
    assert read.command_age == pytest.approx(0.005 * (periods + 0.5))
    missing = read.measurements.loss + (1.0 - read.measurements.loss) * read.measurements.late
    if missing < 1.0:
        drawn = np.random.default_rng(0).geometric(1.0 - missing, 200_000) - 1
        assert periods == pytest.approx(drawn.mean() + 2.0 * drawn.std(), abs=0.02)


SCENARIO = MODELS / "base.scenario.yaml"


@pytest.mark.parametrize("gains", [ScheduledGains(age_phase=0.5), FixedGains(damping=7.0)])
def test_what_is_dumped_is_read_back_and_selected(tmp_path, gains):
    file = tmp_path / "gains.yaml"
    file.write_text("# a remark\n" + dump_gains("mine", gains))
    scenario = with_gains(load_scenario(SCENARIO), str(file))
    assert scenario.selected_gains == "mine"
    assert scenario.gain_sets["mine"] == gains
    assert {"scheduled", "table_2"} < set(scenario.gain_sets)


@pytest.mark.parametrize("text", ["0e6jek&ou7", "1e3", "12_0e+4", "-2e5x", "1.5"])
def test_texts_that_begin_like_numbers_are_read_back_as_texts(text):
    assert parse(write({"key": text, text: 2.0})) == {"key": text, text: 2.0}
    assert parse("[1e3, 0e6jek, -2e5x]") == [1000.0, "0e6jek", "-2e5x"]


def test_a_name_selects_and_nothing_changes_without_one():
    scenario = load_scenario(SCENARIO)
    assert with_gains(scenario, "table_2").selected_gains == "table_2"
    assert with_gains(scenario, None) is scenario


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("selected: mine\nsets: {mine: !ScheduledGains {age_phase: -1}}", r"gains.yaml: sets.mine.age_phase"),
        ("selected: other\nsets: {mine: !ScheduledGains {}}", r"gains.yaml: selected: 'other'"),
        ("selected: mine\nset: {}", r"gains.yaml: set: "),
        ("[1, 2]", r"gains.yaml: the file"),
        ("selected: {", r"gains.yaml: line 2, column 1"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_key(tmp_path, text, complaint):
    (tmp_path / "gains.yaml").write_text(text)
    with pytest.raises(ScenarioError, match=complaint):
        with_gains(load_scenario(SCENARIO), str(tmp_path / "gains.yaml"))


def test_neither_name_nor_file_is_refused():
    with pytest.raises(ScenarioError, match="scheduled, table_2, or a file"):
        with_gains(load_scenario(SCENARIO), "fast")


@pytest.mark.parametrize(
    ("deployment", "age"),
    [
        (Deployment(), None),
        (Deployment(control_rate=1000.0), None),
        (Deployment(control_rate=200.0, measurements=Measurements(delay=0.012)), 0.0175),
        (Deployment(control_rate=100.0, actuators=ActuatorLimits(lag=0.02)), 0.025),
        (Deployment(actuators=ActuatorLimits(lag=0.02)), 0.02),
    ],
)
def test_rules_without_an_age_of_their_own_get_that_of_the_deployment(deployment, age):
    """Delays are rounded up to whole periods; a team below 15 ms keeps the gains of an ideal one."""
    scenario = replace(load_scenario(SCENARIO), deployment=deployment)
    scheduled = scenario.gain_sets["scheduled"]
    assert scheduled.command_age == (age if age is None else pytest.approx(age))
    assert replace(scheduled, command_age=None) == ScheduledGains()
    assert scenario.gain_sets["table_2"] == FixedGains()
