"""Robots and supervisor as processes, with sockets between them, in lock-step."""

import os
from dataclasses import replace
from functools import partial

import pytest

from coop_drake.errors import MessagingError
from coop_drake.messages import SUPERVISOR, Hello, Present, Welcome, local_book
from coop_drake.messages.codec import decode, header_of
from coop_drake.messages.wire import MESSAGES
from coop_drake.nodes import LocalTeam, run_supervisor, run_world, simulate_in_processes
from coop_drake.nodes.one_process import DirectExchange, simulate_apart
from coop_drake.scenario import Control, Hold, Measurements, Messages
from coop_drake.simulation import communication, simulate
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = pytest.mark.no_cover

SIZE = 148
"""Bytes on the team's channel in the transport of the test, with headers and the opening of sessions."""


@pytest.mark.slow
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


def test_a_transport_needs_a_few_hundred_bytes_between_robots(tmp_path):
    """Every byte of the team's channel is a message of the schema; the messages are those of one process."""
    scenario, plan = sampled("base")
    together = DirectExchange()
    counted = communication(simulate_apart(scenario, plan, small_maps(), exchange=together))
    book, recorded = local_book(2), tmp_path / "bytes"
    log = os.open(recorded, os.O_CREAT | os.O_APPEND | os.O_WRONLY)
    team = LocalTeam(scenario, plan, small_maps(), book)
    team.work[SUPERVISOR] = partial(
        run_supervisor,
        tap=lambda way, peer, data: os.write(log, bytes((way == "sent", max(peer, 0), len(data))) + data),
    )
    with team:
        run_world(scenario, plan, book, gone=team.gone)
    os.close(log)
    data, said = recorded.read_bytes(), []
    while data:
        sent, robot, size = data[:3]
        whole = data[3 : 3 + size]
        said.append((bool(sent), robot, decode(whole, header_of(whole), MESSAGES), size))
        data = data[3 + size :]
    opening = [message for _, _, message, _ in said if isinstance(message, Hello | Welcome | Present)]
    assert len(opening) == 6
    for robot in range(2):
        for sent, sender in ((False, robot), (True, None)):
            expected = [message for _, who, message in together.messages if who == sender]
            messages = [m for way, peer, m, _ in said if (way, peer) == (sent, robot) and m not in opening]
            assert messages == expected
    assert len(said) == len(opening) + counted.messages
    assert sum(size for _, _, _, size in said) == SIZE


@pytest.mark.slow
def test_processes_with_another_plan_are_turned_away(capfd):
    scenario, plan = sampled("base")
    book = local_book(2)
    with (
        LocalTeam(scenario, replace(plan, gain_set="another"), small_maps(), book),
        pytest.raises(MessagingError, match="robot 0, robot 1, the supervisor"),
    ):
        run_world(scenario, plan, book, opening=2.0)
