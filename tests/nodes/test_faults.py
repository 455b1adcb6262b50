"""What a team of processes does when one of them is missing: faults at a sample of a run in lock-step."""

import os
import signal

import numpy as np
import pytest

from coop_drake.errors import MessagingError
from coop_drake.messages import SUPERVISOR, local_book
from coop_drake.nodes import LocalTeam, run_world
from coop_drake.nodes.pacing import Pacing
from coop_drake.simulation import simulate
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = [pytest.mark.no_cover, pytest.mark.slow]

PATIENT = {"patience": 1.0, "rejoin": 0.0}

FAULT = 40
"""Sample of the fault; the team is on its way."""


def run_with(team_name, act, **options):
    """The log of a run in which something is done to the processes at a sample."""
    scenario, plan = sampled(team_name)
    book = local_book(3 if team_name == "three" else 2)
    with LocalTeam(scenario, plan, small_maps(), book) as team:

        def before(sample):
            if sample == FAULT:
                act(team)

        return run_world(scenario, plan, book, gone=team.gone, before=before, **PATIENT | options)


def kill(index):
    def act(team):
        team.processes[index].kill()
        team.processes[index].join()

    return act


def stop(index):
    return lambda team: os.kill(team.processes[index].pid, signal.SIGSTOP)


@pytest.mark.parametrize(
    ("team", "act", "name"),
    [
        ("base", kill(1), "robot 1"),
        ("base", stop(0), "robot 0"),
        ("three", kill(2), "robot 2"),
    ],
)
def test_a_team_without_one_robot_brakes_and_rests_without_contact(team, act, name):
    log = run_with(team, act)
    assert not log.reached
    assert log.violation.startswith(f"{name} has not answered since t = 0.39 s; the team rests since t = ")
    assert min(log.workspace_clearance.min(), log.body_clearance.min()) > 0.0
    assert np.abs(log.joint_rates[-1]).max() < 0.02


def test_a_team_without_supervisor_rests_in_its_cell():
    log = run_with("base", kill(SUPERVISOR))
    assert log.violation.startswith("the supervisor has not answered since t = 0.39 s; the team rests")
    assert log.cell_index[-1] == log.cell_index[log.times <= 0.4][-1]
    assert log.funnel_margin.min() > 0.0
    assert log.cell_clearance.min() > 0.0


def test_a_process_that_goes_on_in_time_changes_nothing():
    def pause(team):
        os.kill(team.processes[1].pid, signal.SIGSTOP)
        os.kill(team.processes[1].pid, signal.SIGCONT)

    log = run_with("base", pause)
    assert log.reached


def test_a_process_that_is_missing_at_the_start_is_named():
    scenario, plan = sampled("base")
    book = local_book(2)
    with LocalTeam(scenario, plan, small_maps(), book) as team:
        kill(1)(team)
        with pytest.raises(MessagingError, match="robot 1 ended before the start"):
            run_world(scenario, plan, book, gone=team.gone)
    assert not any(process.is_alive() for process in team.processes.values())


def test_the_pace_of_the_wall_clock_changes_nothing_where_nobody_is_late():
    facts = {}
    log = run_with("base", lambda team: None, pacing=Pacing(allowed=30.0), report=facts.update)
    scenario, plan = sampled("base")
    assert differences(log, simulate(scenario, plan, small_maps())) == []
    ages = facts["command_ages"]
    assert ages["count"] == 2 * (1 + round(log.times[-1] / 0.01))
    assert 0.0 < ages["median"] <= ages["high"] <= ages["largest"] < 30.0
    assert ages["late"] == 0
    assert [process["state"] for process in facts["processes"]] == ["follows the plan"] * 2 + ["there"]
    assert facts["processes"][0]["team_messages"] > 0
    assert facts["refused"] == {}


def test_a_robot_that_is_late_for_too_long_stops_a_paced_team():
    facts = {}
    log = run_with("base", stop(1), pacing=Pacing(allowed=1.0), report=facts.update)
    assert log.violation.startswith("robot 1 has not answered since t = 0.39 s; the team rests")
    assert facts["processes"][1]["state"] == "silent"
    assert facts["processes"][1]["missing_since"] == pytest.approx(0.39)
