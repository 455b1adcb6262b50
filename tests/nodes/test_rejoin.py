"""Processes that end or stand still on the way: the team rests, and goes on when all are there again."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.errors import RefusalError
from coop_drake.messages import SUPERVISOR, local_book
from coop_drake.nodes import LocalTeam, run_world
from coop_drake.nodes.pacing import Pacing
from coop_drake.plant import planning_problem, run_setup
from coop_drake.simulation import simulate
from coop_drake.verification.runs import verify_log
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = pytest.mark.no_cover

FAULT = 40
"""Sample of the fault; the team is on its way."""


def run_with(team_name, acts, **options):
    """Log and facts of a run in which something is done to the processes at samples."""
    scenario, plan = sampled(team_name)
    book, facts, told = local_book(3 if team_name == "three" else 2), {}, []
    with LocalTeam(scenario, plan, small_maps(), book, restarts=1) as team:

        def before(sample):
            if sample in acts:
                acts[sample](team)

        log = run_world(
            scenario,
            plan,
            book,
            gone=team.gone,
            revive=team.revive,
            before=before,
            report=facts.update,
            tell=told.append,
            **options,
        )
    return log, facts, told


def kill(*indices):
    def act(team):
        for index in indices:
            team.processes[index].kill()
            team.processes[index].join()

    return act


def send(index, number):
    return lambda team: os.kill(team.processes[index].pid, number)


def nothing_touched(log):
    return min(log.workspace_clearance.min(), log.body_clearance.min()) > 0.05


@pytest.mark.slow
def test_a_robot_that_is_killed_and_started_again_rejoins_and_the_team_arrives():
    log, facts, told = run_with("base", {FAULT: kill(1)})
    assert log.reached
    assert not log.violation
    assert nothing_touched(log)
    assert facts["restarts"] == {"robot 1": 1}
    (stop,) = facts["stops"]
    assert (stop["cause"], stop["since"]) == ("robot 1", pytest.approx(0.42))
    assert stop["since"] < stop["rested"] < stop["resumed"] < log.times[-1]
    assert told[0] == "robot 1 has not answered since t = 0.39 s; it is started again"
    waits = (log.times > stop["rested"]) & (log.times < stop["resumed"])
    assert np.abs(log.object_twist[waits]).max() < 0.03
    after = log.times > stop["resumed"] + 1.0
    assert min(log.slice_margin[after].min(), log.funnel_margin[after].min()) > 0.0
    assert log.cell_clearance.min() > 0.0
    assert log.governor_spread[after].max() < 1e-9
    scenario, plan = sampled("base")
    against = plan, planning_problem(scenario), run_setup(scenario)
    verified = verify_log(log, *against, braked=True)
    assert verified.proved == "in this run nothing touched, between the rows, too"
    assert verified.not_proved.startswith("that the team followed the plan")
    with pytest.raises(RefusalError, match=r"cell|slice|funnel|interval"):
        verify_log(log, *against)
    moved = log.object_pose + [0.01, 0.0, 0.0] * (log.times > 1.0)[:, None]
    with pytest.raises(RefusalError, match=r"object_pose|object_twist|base_poses"):
        verify_log(replace(log, object_pose=moved), *against, braked=True)


@pytest.mark.slow
def test_a_supervisor_that_is_killed_and_started_again_learns_the_cell_and_nothing_else_changes():
    log, facts, _ = run_with("base", {FAULT: kill(SUPERVISOR)})
    scenario, plan = sampled("base")
    together = simulate(scenario, plan, small_maps())
    assert log.reached
    assert facts["restarts"] == {"the supervisor": 1}
    assert facts["stops"] == []
    assert min(log.funnel_margin.min(), log.slice_margin.min(), log.cell_clearance.min()) > 0.0
    assert sorted(set(log.cell_index.tolist())) == sorted(set(together.cell_index.tolist()))


@pytest.mark.slow
def test_a_robot_and_the_supervisor_that_are_killed_together_rejoin():
    log, facts, _ = run_with("three", {FAULT: kill(2, SUPERVISOR)})
    assert log.reached
    assert nothing_touched(log)
    assert facts["restarts"] == {"robot 2": 1, "the supervisor": 1}


@pytest.mark.slow
def test_who_is_killed_too_often_is_named():
    log, _, _ = run_with("base", {FAULT: kill(1), FAULT + 140: kill(1)})
    assert not log.reached
    assert log.violation.startswith("robot 1 has not answered since t = 1.79 s; the team rests since t = ")
    assert nothing_touched(log)


@pytest.mark.slow
def test_a_paced_team_holds_while_a_robot_stands_still_and_goes_on_after_it():
    acts = {FAULT: send(1, signal.SIGSTOP), FAULT + 50: send(1, signal.SIGCONT)}
    log, facts, told = run_with("base", acts, pacing=Pacing(allowed=0.3))
    assert log.reached
    assert nothing_touched(log)
    assert facts["restarts"] == {}
    assert [stop["cause"] for stop in facts["stops"]] == ["robot 1"]
    assert "robot 1 is there again" in told
