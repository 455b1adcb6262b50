"""Whole transports of processes whose messages are lost, late or repeated, and whose clocks are apart."""

from functools import cache

import pytest

from coop_drake.messages.faults import ChannelFaults, ClockFault, Faults, Gap
from coop_drake.nodes import simulate_in_processes
from coop_drake.nodes.pacing import Pacing
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = [pytest.mark.no_cover, pytest.mark.slow]

AWAY = Gap(0.4, 0.3)
BAD = ChannelFaults(loss=0.2, repeat=0.2, late=0.2, late_by=0.03)
POOR = ChannelFaults(loss=0.02, repeat=0.05, late=0.03, late_by=0.02)
CASES = {
    "the team's messages": ("three", Faults(seed=1, team=BAD), 0),
    "measurements and efforts": ("base", Faults(seed=4, sensors=POOR, efforts=POOR), 0),
    "no messages of the team for a while": ("base", Faults(team=ChannelFaults(gaps=(AWAY,))), 0),
    "the world's stream is interrupted": ("base", Faults(sensors=ChannelFaults(gaps=(AWAY,))), 1),
    "one robot's efforts are interrupted": (
        "base",
        Faults(efforts=ChannelFaults(gaps=(Gap(0.4, 0.3, (1,)),))),
        1,
    ),
    "all of this by the wall clock": (
        "base",
        Faults(seed=1, team=BAD, sensors=ChannelFaults(gaps=(Gap(0.4, 0.3, (1,)),)), efforts=POOR),
        1,
    ),
    "clocks apart, and a robot hears nothing": (
        "elbow",
        Faults(
            clocks=(ClockFault(0, -0.01, -1e-3), ClockFault(1, 0.02, 1e-3)),
            sensors=ChannelFaults(gaps=(Gap(0.4, 0.3, (1,)),)),
        ),
        1,
    ),
}


def run(case):
    team, faults, _ = CASES[case]
    facts = {}
    scenario, plan = sampled(team)
    pacing = Pacing(allowed=1.0) if "wall clock" in case else None
    log = simulate_in_processes(
        scenario, plan, small_maps(), faults=faults, pacing=pacing, report=facts.update
    )
    return log, facts


kept = cache(run)


@pytest.mark.parametrize("case", CASES)
def test_a_team_goes_on_or_waits_at_rest_and_arrives_without_contact(case):
    log, facts = kept(case)
    assert log.reached
    assert not log.violation
    assert min(log.workspace_clearance.min(), log.body_clearance.min()) > 0.0
    assert len(facts["stops"]) == CASES[case][2]
    assert all(stop["since"] < stop["rested"] < stop["resumed"] for stop in facts["stops"])


def test_the_same_faults_give_the_same_run():
    case = "measurements and efforts"
    first, facts = kept(case)
    again, _ = run(case)
    assert differences(first, again) == []
    refused = [process["refused"] for process in facts["processes"]]
    assert facts["refused"].keys() == {"SEQUENCE"}
    assert min(refused) > 0
