"""Robots and supervisor as processes, with sockets between them, in lock-step."""

import os
from dataclasses import replace
from functools import partial

import pytest

from coop_drake.errors import MessagingError
from coop_drake.messages import SUPERVISOR, Ready, Switch, local_book
from coop_drake.messages.codec import decode, header_of
from coop_drake.messages.wire import MESSAGES
from coop_drake.nodes import LocalTeam, run_supervisor, run_world, simulate_in_processes
from coop_drake.scenario import Control, Hold, Measurements, Messages
from coop_drake.simulation import communication, simulate
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = pytest.mark.no_cover


def test_a_held_team_of_three_with_noise_delay_and_losses_runs_as_in_one_process():
    scenario, plan = sampled(
        "three",
        Control(hold=Hold(at=(0.3,), duration=0.3, silence=0.1)),
        measurements=Measurements(1e-3, 5e-4, 1e-3, delay=0.01),
        messages=Messages(loss=0.2),
    )
    together = simulate(scenario, plan, small_maps())
    assert together.reached
    assert differences(together, simulate_in_processes(scenario, plan, small_maps())) == []


def news(said):
    """Direction and message, robot by robot, without those that are said again."""
    for robot in range(2):
        before = {}
        for sent, peer, message, _ in said:
            if peer == robot and before.get((sent, type(message))) != message:
                before[sent, type(message)] = message
                yield sent, message


def test_a_transport_needs_a_few_hundred_bytes_between_robots(tmp_path):
    """Every byte of the team's channel is a message of the schema, and there is no other message."""
    scenario, plan = sampled("base")
    book, recorded = local_book(2), tmp_path / "bytes"
    log = os.open(recorded, os.O_CREAT | os.O_APPEND | os.O_WRONLY)
    team = LocalTeam(scenario, plan, small_maps(), book)
    team.work[SUPERVISOR] = partial(
        run_supervisor,
        tap=lambda way, peer, data: os.write(log, bytes((way == "sent", max(peer, 0), len(data))) + data),
    )
    with team:
        counted = communication(run_world(scenario, plan, book, gone=team.gone))
    os.close(log)
    data, said = recorded.read_bytes(), []
    while data:
        sent, robot, size = data[:3]
        whole = data[3 : 3 + size]
        said.append((bool(sent), robot, decode(whole, header_of(whole), MESSAGES), size))
        data = data[3 + size :]
    ready = [message for sent, message in news(said) if isinstance(message, Ready) and not sent]
    switches = [message for sent, message in news(said) if isinstance(message, Switch) and sent]
    assert len(ready) == sum(counted.reports)
    assert [switch.cell for switch in switches] == [k for _ in range(2) for k in range(1, len(plan.cells))]
    kinds = [type(message).__name__ for _, _, message, _ in said]
    assert {*kinds} == {"Hello", "Welcome", "Present", "Ready", "Switch"}
    assert kinds.count("Present") == 2
    assert sum(size for _, _, _, size in said) < 400


def test_processes_with_another_plan_are_turned_away(capfd):
    scenario, plan = sampled("base")
    book = local_book(2)
    with (
        LocalTeam(scenario, replace(plan, gain_set="another"), small_maps(), book),
        pytest.raises(MessagingError, match="robot 0, robot 1, the supervisor"),
    ):
        run_world(scenario, plan, book, opening=2.0)
