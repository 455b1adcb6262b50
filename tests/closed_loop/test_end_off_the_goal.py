"""A goal that is itself in collision: the transport ends within its tolerance, and its log is verified."""

import json

from tests.support.cli import invoke
from tests.support.scenarios import write_scenario


def test_a_transport_ends_off_a_goal_in_collision_and_within_its_tolerance(tmp_path):
    """The object, half a metre wide, has its middle 0.24 m from the wall; the tolerance is 0.03 m."""
    goal = {"object": {"x": 3.2, "y": 0.24, "theta": 0.0}, "tolerances": {"position": 0.03}}
    scenario, out = write_scenario(tmp_path / "room.scenario.yaml", goal=goal), tmp_path / "out"
    run = invoke("run", scenario, "--out", out, "--json")
    assert run.exit_code == 0, run.stderr
    assert json.loads(run.stdout)["final_position_error_m"] < 0.03
    last = json.loads((out / "plan.json").read_text())["transitions"][-1]
    assert last["target"][1] > 0.25
    for name, answer in (("plan.json", "found"), ("log.npz", "arrived")):
        verified = invoke("verify", out / name, scenario, "--json")
        assert (verified.exit_code, json.loads(verified.stdout)["answer"]) == (0, answer)
