"""A gain set in a file of its own goes where a name goes."""

from dataclasses import replace

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.scenario import (
    ActuatorLimits,
    Deployment,
    Measurements,
    dump_gains,
    load_scenario,
    with_gains,
)
from tests.support.scenarios import MODELS, write_scenario

SCENARIO = MODELS / "base.scenario.yaml"


@pytest.mark.parametrize("gains", [ScheduledGains(age_phase=0.5), FixedGains(damping=7.0)])
def test_what_is_dumped_is_read_back_and_selected(tmp_path, gains):
    file = tmp_path / "gains.yaml"
    file.write_text("# a remark\n" + dump_gains("mine", gains))
    scenario = with_gains(load_scenario(SCENARIO), str(file))
    assert scenario.selected_gains == "mine"
    assert scenario.gain_sets["mine"] == gains
    assert {"scheduled", "table_2"} < set(scenario.gain_sets)


def test_the_file_is_a_section_of_a_scenario(tmp_path):
    text = dump_gains("mine", ScheduledGains(age_phase=0.5))
    plain = write_scenario(tmp_path / "room.scenario.yaml").read_text()
    indented = "".join(f"  {line}\n" for line in text.splitlines())
    (tmp_path / "room.scenario.yaml").write_text(f"{plain}\ngains:\n{indented}")
    scenario = load_scenario(tmp_path / "room.scenario.yaml")
    assert scenario.gain_sets[scenario.selected_gains] == ScheduledGains(age_phase=0.5)


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
