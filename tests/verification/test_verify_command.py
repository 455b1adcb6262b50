"""The command that verifies: it knows both kinds of file, and says what it refuses and where."""

import json

import pytest

from tests.support.certificates import changed, write
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

GAP = [[0, 0], [4, 0], [4, 1.8], [5, 1.8], [5, 0], [9, 0], [9, 4], [5, 4], [5, 2.2], [4, 2.2], [4, 4], [0, 4]]


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """An open room with its plan and a gap too narrow with its certificate."""
    folder = tmp_path_factory.mktemp("planned")
    room = write_scenario(folder / "room.scenario.yaml")
    gap = write_scenario(
        folder / "gap.scenario.yaml",
        workspace={"outer": GAP},
        start={"object": {"x": 2.0, "y": 2.0, "theta": 0.0}, "joints": {"robot_0": [0.0], "robot_1": [0.0]}},
        goal={"object": {"x": 7.0, "y": 2.0, "theta": 0.0}},
    )
    codes = [invoke("plan", path, "--out", folder / path.stem).exit_code for path in (room, gap)]
    assert codes == [0, 3]
    return (room, folder / "room.scenario" / "plan.json"), (gap, folder / "gap.scenario" / "certificate.json")


@pytest.mark.parametrize(("number", "answer"), [(0, "found"), (1, "infeasible")])
def test_both_answers_are_verified(planned, number, answer):
    scenario, file = planned[number]
    result = invoke("verify", file, scenario, "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert (facts["valid"], facts["answer"]) == (True, answer)
    assert {"name", "count", "tightest", "unit", "arrays"} == facts["checks"][0].keys()
    shown = invoke("verify", file, scenario)
    assert f"valid, {answer}: {facts['subject']}" in " ".join(shown.stdout.split())
    assert all(heading in shown.stdout for heading in ("checked", "times", "closest to refusal"))
    assert shown.stdout.splitlines()[-1] == f"Proved: {facts['proved']}. Not proved: {facts['not_proved']}"
    assert invoke("verify", file, scenario, "--quiet").output == ""


def test_an_infeasible_scenario_says_where_its_proof_is(planned, tmp_path):
    scenario, _ = planned[1]
    result = invoke("plan", scenario, "--out", tmp_path)
    assert result.exit_code == 3
    assert "The proof is in" in result.stdout
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == [".coop_drake_results.json", "certificate.json"]


def test_refused_files_say_what_and_where(planned, tmp_path):
    scenario, file = planned[0]
    document = json.loads(file.read_text())
    altered = changed(document, ("transitions", 0, "neck"), document["transitions"][0]["neck"] + 1e-9)
    result = invoke("verify", write(altered, tmp_path / "plan.json", signed=False), scenario, "--json")
    assert result.exit_code == 1
    facts = json.loads(result.stdout)
    assert (facts["valid"], facts["where"]) == (False, "digest")
    assert "it was altered" in result.stderr
    other = invoke("verify", file, planned[1][0], "--json")
    assert other.exit_code == 1
    assert json.loads(other.stdout)["where"] == "start"


@pytest.mark.parametrize("content", ["{}", "[]", "not json", '{"format": "coop_drake plan"}'])
def test_bad_files_are_bad_input(planned, tmp_path, content):
    (tmp_path / "plan.json").write_text(content)
    result = invoke("verify", tmp_path / "plan.json", planned[0][0], "--json")
    assert result.exit_code == 2
    assert "plan.json" in json.loads(result.stdout)["error"]
    assert invoke("verify", tmp_path / "none.json", planned[0][0]).exit_code == 2
