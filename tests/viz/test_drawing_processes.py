"""Processes that draw a run: what they write, and how their failures and the end of a command reach them."""

from __future__ import annotations

import os

import pytest

from coop_drake.errors import ProcessError
from coop_drake.scenario import load_scenario
from coop_drake.viz.drawing_processes import DrawingProcesses
from tests.support.cases import case
from tests.support.scenarios import MODELS
from tests.support.synthetic_log import synthetic_log, synthetic_plan


@pytest.fixture
def drawing():
    """Processes that were told the plan of a run, and the run's log."""
    problem, scenario = case("base"), load_scenario(MODELS / "base.scenario.yaml")
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        yield processes, synthetic_log(problem)


def alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_both_write_what_they_draw_and_end(drawing, tmp_path):
    processes, log = drawing
    processes.draw(log, tmp_path)
    processes.wait("recording", "figures")
    names = {path.name for path in tmp_path.iterdir()}
    assert {"transport.html", "fig04_start_and_goal.png", "fig05_path.png", "summary.png"} <= names
    assert not any(alive(process.pid) for process, _ in processes._running.values())


def test_without_figures_the_recording_alone_is_written(tmp_path):
    problem, scenario = case("base"), load_scenario(MODELS / "base.scenario.yaml")
    with DrawingProcesses(figures=False) as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        processes.draw(synthetic_log(problem), tmp_path)
        processes.wait("recording", "figures")
    assert [path.name for path in tmp_path.iterdir()] == ["transport.html"]


def test_what_goes_wrong_in_a_process_is_raised_here(drawing, tmp_path):
    processes, log = drawing
    taken = tmp_path / "taken"
    taken.write_text("")
    processes.draw(log, taken)
    with pytest.raises(OSError, match=r"Not a directory|File exists"):
        processes.wait("recording", "figures")


def test_a_process_that_is_ended_is_named(drawing, tmp_path):
    processes, log = drawing
    processes._running["recording"][0].kill()
    processes.draw(log, tmp_path)
    with pytest.raises(ProcessError, match="the process that draws the recording ended with code -9"):
        processes.wait("recording", "figures")


def test_both_end_with_the_block_and_with_the_command():
    problem, scenario = case("base"), load_scenario(MODELS / "base.scenario.yaml")
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        begun = [process for process, _ in processes._running.values()]
        assert [process.is_alive() for process in begun] == [True, True]
    assert not any(process.is_alive() for process in begun)
    with DrawingProcesses() as processes:
        processes.begin(scenario, problem, synthetic_plan(problem))
        for _, connection in processes._running.values():
            connection.close()  # As the end of the command closes it.
        for process, _ in processes._running.values():
            process.join(timeout=300)
            assert process.exitcode == 0
