"""What the commands of processes refuse, with the exit code 2 and a message that says what is allowed."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.cli.summary import process_lines

BASE = str(Path(__file__).parents[2] / "models" / "base.scenario.yaml")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", BASE, "--apart"], "deployment.control_rate"),
        (["apart", "world", BASE], "deployment.control_rate"),
        (["apart", "robot", BASE, "0"], "deployment.control_rate"),
        (["apart", "supervisor", BASE], "deployment.control_rate"),
        (["run", BASE, "--free-running"], "--free-running needs --apart"),
        (["run", BASE, "--faults", "faults.yaml"], "--faults needs --apart"),
        (["simulate", BASE, "--blocks", "fused"], "is gone: every robot has blocks of its own"),
        (["verify", "plan.json", BASE, "--braked"], "--braked is about the log of a run"),
    ],
)
def test_what_processes_cannot_do_is_bad_input(arguments, said):
    result = CliRunner(env={"COLUMNS": "300"}).invoke(app, arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_the_closing_lines_tell_of_every_process_and_of_ages():
    processes = [{"name": "robot 0", "state": "gone", "team_messages": 7, "refused": 2}]
    ages = {
        "median": 0.001,
        "high": 0.002,
        "largest": 0.02,
        "allowed": 0.01,
        "late": 1,
        "count": 90,
        "slipped": 0.5,
    }
    lines = process_lines({"processes": processes, "refused": {"KIND": 2, "VALUE": 1}, "command_ages": ages})
    assert lines == [
        "robot 0: gone, 7 messages sent to the team, 2 refused",
        "the world: 3 messages refused",
        "Ages of commands: median 1.0 ms, 99.9 % below 2.0 ms, largest 20.0 ms; "
        "allowed 10.0 ms, exceeded by 1 of 90",
        "The wall clock was 0.50 s ahead of the simulated time at the end",
    ]
    assert process_lines({}) == []
