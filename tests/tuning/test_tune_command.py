"""The command tune on a small room: a gain set that `run` takes, and refusals before any work."""

from __future__ import annotations

import json
import multiprocessing
import sys
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.cli.gain_search import Workers
from coop_drake.laws import ScheduledGains
from coop_drake.scenario import load_scenario, with_gains
from tests.support.scenarios import write_scenario
from tests.support.small_plan import small_plan


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    goal = {"object": {"x": 2.6, "y": 2.0, "theta": 0.0}, "tolerances": {"position": 0.05, "angle": 0.05}}
    return write_scenario(tmp_path_factory.mktemp("room") / "room.scenario.yaml", goal=goal)


def called(*arguments):
    return CliRunner().invoke(app, ["tune", *map(str, arguments)])


@pytest.mark.slow
def test_a_gain_set_comes_out_that_the_scenario_takes(room, tmp_path):
    result = called(room, "--runs", 2, "--workers", 1, "--vary", "age_phase", "--out", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout.splitlines()[-1])
    assert facts["trials"] == 2
    assert facts["after"]["time"] <= facts["before"]["time"]
    assert facts["after"]["peak_force"] <= facts["before"]["peak_force"]
    tuned = with_gains(load_scenario(room), facts["gains_file"])
    trials = json.loads((tmp_path / "trials.json").read_text())
    assert len(trials["trials"]) == 3
    assert tuned.gain_sets["tuned"].age_phase == trials["trials"][trials["best"]]["gains"]["age_phase"]
    assert (tmp_path / "tuning.png").stat().st_size > 10_000
    assert "seed 0. Verified" in (tmp_path / "gains.yaml").read_text()


def test_ctrl_c_leaves_the_best_so_far(room, tmp_path, monkeypatch):
    def interrupted(_workers, _gain_sets):
        raise KeyboardInterrupt

    monkeypatch.setattr(Workers, "try_all", interrupted)
    result = called(room, "--workers", 1, "--out", tmp_path)
    assert result.exit_code == 130
    assert "Not verified: interrupted after 0 trials" in (tmp_path / "gains.yaml").read_text()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--criterion", "speed"), "expected one of time"),
        (("--limit", "time<16"), "expected such as"),
        (("--vary", "funnel"), "expected one of age_phase"),
        (("--gains", "fast"), "or a file with a gain set"),
    ],
)
def test_what_makes_no_sense_is_refused_before_any_work(room, tmp_path, arguments, complaint):
    result = called(room, *arguments, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert complaint in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_a_missing_optimizer_is_named_before_any_work(room, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    result = called(room, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "pip install 'cma>=4.0'" in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_processes_end_amid_their_trials_without_a_word(monkeypatch):
    said = []
    monkeypatch.setattr(threading, "excepthook", said.append)
    with Workers(Path("none.scenario.yaml"), small_plan(()), (), longest=1.0, count=1) as workers:
        trials = workers.try_all([ScheduledGains()] * 8)
        del trials  # As where Ctrl-C leaves the loop over them.
    assert not said
    assert not multiprocessing.active_children()
