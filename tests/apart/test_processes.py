"""Robots and supervisor as processes: runs are those of one process, whatever goes wrong ends at rest."""

import os
import signal
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.one_process import DirectExchange, simulate_apart
from coop_drake.apart import LocalTeam, network_of, run_world
from coop_drake.apart.faults import NO_FAULTS, ChannelFaults, ClockFault, Faults, Gap
from coop_drake.apart.messages import SUPERVISOR
from coop_drake.apart.world import Pacing
from coop_drake.errors import MessagingError, RefusalError
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario import (
    ActuatorLimits,
    Control,
    Deafness,
    Deployment,
    Hold,
    Measurements,
    Messages,
    RobotDepartures,
    Silence,
)
from coop_drake.simulation import communication, simulate
from coop_drake.verification.runs import verify_log
from tests.support.motions import motion_under_budget, small_motion
from tests.support.same_runs import differences
from tests.support.small_loop import sampled, small_maps

pytestmark = pytest.mark.no_cover

FAULT = 40
"""Sample of a fault; the team is on its way."""


def run(problem, acts=None, *, restarts=1, faults=NO_FAULTS, **options):
    """Log, facts and words of a run in which something is done to the processes at samples."""
    network, facts, told = network_of(*problem, faults=faults), {}, []
    with LocalTeam(*problem, small_maps(), network, restarts=restarts) as team:

        def before(sample):
            if acts and sample in acts:
                acts[sample](team)

        log = run_world(
            *problem,
            network,
            processes=team,
            before=before,
            report=facts.update,
            tell=told.append,
            **options,
        )
    return log, facts, told


@cache
def together():
    """The log of the sampled team of base in one process."""
    return simulate(*sampled("base"), small_maps())


def kill(*indices):
    def act(team):
        for index in indices:
            team.processes[index].kill()
            team.processes[index].join()

    return act


def signalled(index, *numbers):
    return lambda team: [os.kill(team.processes[index].pid, number) for number in numbers]


def nothing_touched(log, by=0.0):
    return min(log.workspace_clearance.min(), log.body_clearance.min()) > by


def test_a_run_is_that_of_one_process_with_as_many_messages_of_the_team():
    problem, direct = sampled("base"), DirectExchange()
    counted = communication(simulate_apart(*problem, small_maps(), exchange=direct))
    log, facts, _ = run(problem)
    assert log.reached
    assert differences(log, together()) == []
    sent = [process["team_messages"] for process in facts["processes"]]
    assert sent == [*counted.reports, counted.announcements]
    said = [2 if sender is None else 1 for _, sender, _ in direct.messages]
    assert sum(said) == sum(sent) == counted.messages
    cells = [message.cell for _, sender, message in direct.messages if sender is None]
    assert cells == [*range(1, len(problem[1].cells))]


NOISY = {"measurements": Measurements(1e-3, 5e-4, 1e-3, delay=0.01), "messages": Messages(loss=0.2)}
SINGLE = {
    "robots": {
        "robot_0": RobotDepartures(
            clock_error=0.005, silence=Silence(0.5, 0.02, "held"), odometry_scale=0.01
        ),
        "robot_1": RobotDepartures(switch_delay=0.01, deaf=Deafness(0.2, 0.3)),
    }
}


@pytest.mark.slow
@pytest.mark.parametrize(("team", "departures"), [("three", NOISY), ("base", SINGLE)])
def test_a_held_team_with_departures_runs_as_in_one_process(team, departures):
    problem = sampled(team, Control(hold=Hold(at=(0.3,), duration=0.3, silence=0.1)), **departures)
    in_one = simulate(*problem, small_maps())
    assert in_one.reached
    assert differences(in_one, run(problem)[0]) == []


@pytest.mark.slow
def test_the_pace_of_the_wall_clock_changes_nothing_where_nobody_is_late():
    problem = sampled("base")
    log, facts, _ = run(problem, pacing=Pacing(allowed=30.0))
    assert differences(log, together()) == []
    ages = facts["command_ages"]
    assert ages["count"] == 2 * (1 + round(log.times[-1] / 0.01))
    assert 0.0 < ages["median"] <= ages["high"] <= ages["largest"] < 30.0
    assert ages["late"] == 0
    assert [process["state"] for process in facts["processes"]] == ["follows the plan"] * 2 + ["there"]
    assert facts["refused"] == {}


@pytest.mark.slow
def test_who_has_another_plan_or_is_missing_at_the_start_is_named(capfd):
    scenario, plan = sampled("base")
    network, other = network_of(scenario, plan), replace(plan, gain_set="another")
    others = replace(network_of(scenario, other), book=network.book)
    with (
        LocalTeam(scenario, other, small_maps(), others),
        pytest.raises(MessagingError, match="robot 0, robot 1, the supervisor"),
    ):
        run_world(scenario, plan, network, opening=2.0)
    with LocalTeam(scenario, plan, small_maps(), network) as team:
        kill(1)(team)
        with pytest.raises(MessagingError, match="robot 1 ended before the start"):
            run_world(scenario, plan, network, processes=team)
    assert all(process.exitcode is not None for process in team.processes.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "act", "missing"),
    [
        ("base", signalled(0, signal.SIGSTOP), "robot 0"),
        ("three", kill(2), "robot 2"),
        ("base", kill(SUPERVISOR), "the supervisor"),
    ],
)
def test_a_team_without_one_process_rests_without_contact(name, act, missing):
    log, _, _ = run(sampled(name), {FAULT: act}, restarts=0, patience=1.0, rejoin=0.0)
    assert not log.reached
    assert log.violation.startswith(f"{missing} has not answered since t = 0.39 s; the team rests since t = ")
    assert nothing_touched(log)
    assert np.abs(log.joint_rates[-1]).max() < 0.02
    if missing == "the supervisor":  # No drive brakes: the robots bring the object to rest in its cell.
        assert log.cell_index[-1] == log.cell_index[log.times <= 0.4][-1]
        assert min(log.funnel_margin.min(), log.cell_clearance.min()) > 0.0


@pytest.mark.slow
def test_a_robot_that_is_killed_and_started_again_rejoins_and_the_team_arrives():
    problem = sampled("base")
    log, facts, told = run(problem, {FAULT: kill(1)})
    assert log.reached
    assert not log.violation
    assert nothing_touched(log, 0.05)
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
    against = problem[1], planning_problem(problem[0]), run_setup(problem[0])
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
    problem = sampled("base")
    log, facts, _ = run(problem, {FAULT: kill(SUPERVISOR)})
    assert log.reached
    assert facts["restarts"] == {"the supervisor": 1}
    assert facts["stops"] == []
    assert min(log.funnel_margin.min(), log.slice_margin.min(), log.cell_clearance.min()) > 0.0
    assert set(log.cell_index) == set(together().cell_index)


@pytest.mark.slow
def test_a_paced_team_holds_while_a_robot_stands_still_and_goes_on_after_it():
    acts = {FAULT: signalled(1, signal.SIGSTOP), FAULT + 50: signalled(1, signal.SIGCONT)}
    log, facts, told = run(sampled("base"), acts, pacing=Pacing(allowed=0.3))
    assert log.reached
    assert nothing_touched(log, 0.05)
    assert facts["restarts"] == {}
    assert [stop["cause"] for stop in facts["stops"]] == ["robot 1"]
    assert "robot 1 is there again" in told


AWAY, ONE_AWAY = Gap(0.4, 0.3), ChannelFaults(gaps=(Gap(0.4, 0.3, (1,)),))
BAD = ChannelFaults(loss=0.2, repeat=0.2, late=0.2, late_by=0.03)
POOR = ChannelFaults(loss=0.02, repeat=0.05, late=0.03, late_by=0.02)
CLOCKS = (ClockFault(0, -0.01, -1e-3), ClockFault(1, 0.02, 1e-3))
CASES = {
    "the team's messages": ("three", Faults(seed=1, team=BAD), 0),
    "measurements and efforts": ("base", Faults(seed=4, sensors=POOR, efforts=POOR), 0),
    "no messages of the team for a while": ("base", Faults(team=ChannelFaults(gaps=(AWAY,))), 0),
    "the world's stream is interrupted": ("base", Faults(sensors=ChannelFaults(gaps=(AWAY,))), 1),
    "one robot's efforts are interrupted": ("base", Faults(efforts=ONE_AWAY), 1),
    "all by the wall clock": ("base", Faults(seed=1, team=BAD, sensors=ONE_AWAY, efforts=POOR), 1),
    "clocks apart, and a robot hears nothing": ("elbow", Faults(clocks=CLOCKS, sensors=ONE_AWAY), 1),
}


def run_case(case):
    team, faults, _ = CASES[case]
    pacing = Pacing(allowed=1.0) if "wall clock" in case else None
    return run(sampled(team), faults=faults, pacing=pacing)


kept = cache(run_case)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_team_goes_on_or_waits_at_rest_and_arrives_without_contact(case):
    log, facts, _ = kept(case)
    assert log.reached
    assert not log.violation
    assert nothing_touched(log)
    assert len(facts["stops"]) == CASES[case][2]
    assert all(stop["since"] < stop["rested"] < stop["resumed"] for stop in facts["stops"])


@pytest.mark.slow
def test_the_same_faults_give_the_same_run():
    first, facts, _ = kept("measurements and efforts")
    assert differences(first, run_case("measurements and efforts")[0]) == []
    assert facts["refused"].keys() == {"SEQUENCE"}
    assert min(process["refused"] for process in facts["processes"]) > 0


# Teams that pass from cell to cell: words between all.


def passing_problem(team="base", **departures):
    scenario, plan = small_motion(team)
    return replace(scenario, deployment=Deployment(control_rate=200.0, **departures)), plan


@pytest.mark.parametrize(
    "fault",
    [{"deaf": Deafness(0.7, 0.5)}, pytest.param({"silence": Silence(0.6, 0.5)}, marks=pytest.mark.slow)],
)
def test_a_passing_team_is_held_and_goes_on_as_in_one_process(fault):
    problem = passing_problem(
        measurements=Measurements(1e-4, 5e-5, 1e-3, delay=0.01),
        actuators=ActuatorLimits(lag=0.005),
        messages=Messages(loss=0.2, delay=0.01),
        robots={
            "robot_0": RobotDepartures(clock_error=0.0015, **fault),
            "robot_1": RobotDepartures(clock_error=-0.0015),
        },
    )
    log, facts, _ = run(problem)
    assert log.reached
    assert differences(log, simulate(*problem, small_maps())) == []
    samples = round(log.times[-1] / 0.005)
    assert [process["team_messages"] for process in facts["processes"]] == [2 * (samples + 1)] * 3


def test_words_that_are_lost_late_or_cut_off_hold_a_passing_team_at_most():
    faults = Faults(
        team=ChannelFaults(loss=0.2, late=0.1, late_by=0.01, gaps=(Gap(0.6, 0.3, robots=(1,)),)),
        clocks=(ClockFault(0, 0.001, 1e-5),),
    )
    log, facts, _ = run(passing_problem(), faults=faults)
    assert log.reached
    assert nothing_touched(log)
    assert log.governor_spread.max() <= 0.004
    moves = (log.phases[:, :, 1] > 0.0).any(axis=1)
    assert np.count_nonzero(moves[1:] & ~moves[:-1]) >= 2
    assert facts["refused"] == {}


@pytest.mark.parametrize("killed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_passing_team_of_which_a_robot_is_killed_rests_on_its_motion_and_goes_on(killed):
    log, facts, _ = run(passing_problem(), {140: kill(killed)})
    assert log.reached, log.violation
    assert facts["restarts"] == {f"robot {killed}": 1}
    (stop,) = facts["stops"]
    assert 0.6 < stop["rested"] < stop["resumed"] < log.times[-1]
    assert nothing_touched(log)
    assert log.cell_clearance.min() > 0.0


def test_clocks_that_are_more_wrong_than_the_plan_allows_stop_the_team():
    scenario, plan = motion_under_budget()
    wrong = replace(scenario.deployment, clock_error=0.02)
    log, _, _ = run((replace(scenario, deployment=wrong), plan))
    assert not log.reached
    assert log.times[-1] < 1.0
    assert "measurements are older than the plan allows, or have stamps that cannot be" in log.violation


def test_a_passing_team_of_which_a_robot_stays_away_ends_at_rest():
    log, facts, _ = run(passing_problem(), {120: kill(0)}, restarts=0, rejoin=1.0)
    assert not log.reached
    assert "robot 0 has not answered since t = 0.595 s; the team rests since" in log.violation
    assert nothing_touched(log)
    assert len(facts["stops"]) == 1


@pytest.mark.slow
def test_the_supervisor_of_a_passing_team_is_started_again_and_sees_it_arrive():
    log, facts, _ = run(passing_problem(), {300: kill(SUPERVISOR)})
    assert log.reached
    assert nothing_touched(log)
    assert facts["restarts"] == {"the supervisor": 1}
    assert facts["stops"] == []
