"""Plans that are refused by limits of the scenario, and runs that stop in a cell."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import load_plan, save_plan
from coop_drake.answers.log import SimulationLog
from coop_drake.cli import simulate
from coop_drake.simulation import run
from tests.support.certificates import write
from tests.support.cli import invoke
from tests.support.no_drawings import NoDrawings
from tests.support.scenarios import TWO_ROOMS, write_scenario

LIMITS = {"min_clearance": 2.0, "max_transition_time": 0.1}


@pytest.fixture(scope="module")
def refused(tmp_path_factory):
    folder = tmp_path_factory.mktemp("refused")
    scenario = write_scenario(folder / "room.scenario.yaml", planner=LIMITS)
    return scenario, folder / "out", invoke("plan", scenario, "--out", folder / "out", "--json")


def test_plan_names_every_limit_and_writes_the_way(refused):
    _, out, result = refused
    assert result.exit_code == 5, result.stderr
    facts = json.loads(result.stdout)
    assert facts["answer"] == "beyond limits"
    assert [one["limit"] for one in facts["refused_by"]] == [f"planner.{name}" for name in LIMITS]
    assert [one["allowed"] for one in facts["refused_by"]] == list(LIMITS.values())
    assert 0.0 < facts["refused_by"][0]["value"] < 2.0
    assert facts["refused_by"][1]["value"] > 0.1
    assert "planner.min_clearance: in cell 0 the object's path or its target has a clearance" in result.stderr
    assert sorted(path.name for path in out.iterdir()) == [".coop_drake_results.json", "way.json"]


def test_the_way_is_verified_and_not_simulated(refused, tmp_path):
    scenario, out, _ = refused
    verified = invoke("verify", out / "way.json", scenario, "--json")
    assert verified.exit_code == 5, verified.stderr
    assert json.loads(verified.stdout)["answer"] == "beyond limits"
    simulated = invoke("simulate", scenario, "--plan", out / "way.json", "--out", tmp_path / "out")
    assert simulated.exit_code == 2
    assert "refused_by" in simulated.stderr
    patient = write_scenario(tmp_path / "room.scenario.yaml")
    assert invoke("verify", out / "way.json", patient).exit_code == 1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("value", 1.5),
        ("allowed", 0.5),
        ("cell", 7),
        ("limit", "planner.margin"),
        ("unit", "s"),
        ("joint", "robot_0::elbow"),
    ],
)
def test_a_refusal_that_is_not_so_is_refused(refused, tmp_path, key, value):
    scenario, out, _ = refused
    document = json.loads((out / "way.json").read_text())
    document["refused_by"][0][key] = value
    result = invoke("verify", write(document, tmp_path / "way.json", signed=True), scenario)
    assert result.exit_code == 1
    assert "refused_by[0]" in result.stderr


def test_why_draws_the_way_and_the_team_where_it_is_refused(refused, tmp_path):
    result = invoke("why", refused[0], "--out", tmp_path)
    assert result.exit_code == 5, result.stderr
    assert (tmp_path / "why.png").stat().st_size > 10_000


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
