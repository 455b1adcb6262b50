"""A preset names the departures of a usual team; keys beside it replace its own, one by one."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import Deployment, dump_scenario, load_scenario
from coop_drake.typed_data import convert_class
from tests.support.scenarios import MODELS

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
    assert read.command_age == pytest.approx(0.0175)


def test_keys_beside_the_preset_replace_its_own_and_no_others(tmp_path):
    read = loaded(tmp_path, "{preset: mobile_base, mass_error: -0.2, measurements: {delay: 0}}").deployment
    measurements = replace(MOBILE_BASE.measurements, delay=0.0)
    assert read == replace(MOBILE_BASE, mass_error=-0.2, measurements=measurements)
    unlimited = loaded(tmp_path, "{preset: mobile_base, actuators: {base_force: null}}").deployment
    assert (unlimited.actuators.base_force, unlimited.actuators.lag) == (None, 0.005)


def test_a_preset_of_null_is_none(tmp_path):
    assert loaded(tmp_path, "{preset: null, mass_error: 0.1}").deployment == Deployment(mass_error=0.1)


def test_a_scenario_with_a_preset_is_written_and_read_back(tmp_path):
    scenario = loaded(tmp_path, "{preset: mobile_base, actuators: {base_force: null}}")
    again = tmp_path / "again.scenario.yaml"
    again.write_text(dump_scenario(scenario))
    assert load_scenario(again).deployment == scenario.deployment


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
