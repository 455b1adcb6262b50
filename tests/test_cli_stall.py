"""A cell that can never be left: the run stops, and the command says which margin blocks."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import load_plan, save_plan
from coop_drake.answers.log import SimulationLog
from coop_drake.cli import simulate
from coop_drake.simulation import run
from tests.support.cli import invoke
from tests.support.no_drawings import NoDrawings
from tests.support.scenarios import TWO_ROOMS, write_scenario


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A scenario and its plan, of more than one cell."""
    folder = tmp_path_factory.mktemp("stall")
    room = write_scenario(folder / "room.scenario.yaml", **TWO_ROOMS)
    assert invoke("plan", room, "--out", folder).exit_code == 0
    assert len(load_plan(folder / "plan.json").cells) > 1
    return room, folder / "plan.json"


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(run, "PATIENCE_FACTOR", 1.0)
    monkeypatch.setattr(run, "PATIENCE_ALLOWANCE", 0.5)
    monkeypatch.setattr(simulate, "DrawingProcesses", NoDrawings)


def assert_stalled(result, out, complaint):
    assert result.exit_code == 1, result.output
    violation = json.loads(result.stdout)["violation"]
    assert violation.startswith("stalled at t = ")
    assert complaint in violation
    assert complaint in " ".join(result.stderr.split())
    log = SimulationLog.load(out / "log.npz")
    assert not log.reached
    assert set(log.cell_index) == {0}
    assert log.energy_margin.min() >= 0.0 < log.funnel_margin.min()


def test_an_energy_that_no_axis_can_fall_below_is_named(planned, tmp_path):
    room, path = planned
    plan = load_plan(path)
    first, second, *others = plan.transitions
    shut = replace(second.gains, energy_bound=np.full_like(second.gains.energy_bound, 1e-12))
    never = replace(plan, transitions=(first, replace(second, gains=shut), *others))
    save_plan(never, tmp_path / "never.json")
    result = invoke("simulate", room, "--plan", tmp_path / "never.json", "--out", tmp_path, "--json")
    assert_stalled(result, tmp_path, "falls below the next funnel's bound (margin -")


def test_reports_that_never_arrive_are_named(planned, tmp_path):
    _, path = planned
    deployment = {"control_rate": 100.0, "messages": {"loss": 1.0}}
    deaf = write_scenario(tmp_path / "deaf.scenario.yaml", **TWO_ROOMS, deployment=deployment)
    result = invoke("simulate", deaf, "--plan", path, "--out", tmp_path, "--json")
    assert_stalled(
        result,
        tmp_path,
        "it waits until the cell planner receives the robots' reports",
    )
