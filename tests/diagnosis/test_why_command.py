"""The command why: answers, exit codes, pictures, and no traceback for a user's mistake."""

import json

import pytest

from coop_drake.cli.results import ResultFolder
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario


def told_by(path, folder):
    """Commands that report the same plan of a scenario."""
    watch = ("watch", path, "--strategy", "portfolio", "--frames", 2, "--output", folder / "think")
    return ("plan", path, "--out", folder / "plan"), ("why", path, "--out", folder / "why"), watch


@pytest.fixture
def blocked(tmp_path):
    """A goal at which a hand just fits before the wall, but not the base behind it."""
    goal = {"object": {"x": 5.2, "y": 2.0, "theta": 0.0}}
    return write_scenario(tmp_path / "blocked.scenario.yaml", goal=goal)


@pytest.mark.slow
def test_a_blocked_goal_gets_its_sentences_pictures_and_exit_code_3_and_again(blocked, tmp_path):
    out, answers = tmp_path / "out", []
    for _ in range(2):
        result = invoke("why", blocked, "--out", out, "--json")
        assert result.exit_code == 3, result.stderr
        facts = json.loads(result.stdout)
        kept = {name: fact for name, fact in facts.items() if not name.endswith(("seconds", "_mb"))}
        answers.append(kept)
    assert answers[0] == answers[1]
    assert facts["answer"] == "infeasible"
    assert {contact["body"].split("::")[0] for contact in facts["goal"]["contacts"]} == {"robot_0"}
    assert facts["goal"]["walls_moved_back_m"]["found_enough"] > 0.1
    assert facts["diagnosis_cpu_seconds"] > 0.0
    assert facts["sentences"][0] in " ".join(result.stderr.split())
    assert sorted(path.name for path in out.iterdir()) == [".coop_drake_results.json", "why.png", "why.svg"]
    assert (out / "why.svg").read_text().lstrip().startswith("<?xml")


@pytest.mark.slow
def test_a_feasible_scenario_is_said_to_be_so_and_an_older_picture_goes(tmp_path):
    path, out = write_scenario(tmp_path / "room.scenario.yaml"), tmp_path / "out"
    ResultFolder(out).begin("diagnosis")
    (out / "why.png").write_bytes(b"of an older diagnosis")
    result = invoke("why", path, "--out", out)
    assert result.exit_code == 0, result.output
    assert "Nothing blocks: there is a plan" in result.output
    rows = [json.loads(invoke(*command, "--json").stdout) for command in told_by(path, tmp_path)]
    for name in ("answer", "cells", "narrowest_neck_m", "estimated_seconds"):
        assert len({facts[name] for facts in rows}) == 1, name
    assert [path.name for path in out.iterdir()] == [".coop_drake_results.json"]


def test_plan_points_to_why(blocked, tmp_path):
    result = invoke("plan", blocked, "--out", tmp_path / "out")
    assert result.exit_code == 3
    assert f"coop-drake why {blocked}" in result.output.replace("\n", "")
