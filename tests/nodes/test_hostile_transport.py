"""A whole transport of processes beside a client that floods, forges, replays and sends random bytes."""

import random

import pytest
import zmq

from coop_drake.messages import SUPERVISOR, WORLD, Effort, Hello, Present, Ready, Switch, local_book
from coop_drake.messages.codec import encode
from coop_drake.nodes import LocalTeam, run_world
from coop_drake.simulation import simulate
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

pytestmark = pytest.mark.no_cover


class Hostile:
    """Sends to every port of a team what it must refuse."""

    def __init__(self, book):
        self._context, self._dice = zmq.Context(), random.Random(1)
        self._sockets = []
        for address in (book.world.sensors, book.world.efforts, book.supervisor.team):
            for kind in (zmq.DEALER, zmq.REQ, zmq.PUSH):
                socket = self._context.socket(kind)
                socket.linger = 0
                socket.connect(address)
                self._sockets.append(socket)

    def act(self, sample):
        """Send twenty messages of all kinds on each connection that takes them."""
        session, number = self._dice.getrandbits(8), sample + 2
        forged = [
            encode(Effort(sample, 0.01 * sample, 9, 0, (1e6,) * 5), 0, session, number),
            encode(Ready(0, True), 1, session, number),
            encode(Switch(1, sample), SUPERVISOR, session, number),
            encode(Present(), 0, session, 1),
            encode(Hello(sample, 0, 0), 0, 0, 0),
            encode(Hello(sample, 0, 0), WORLD, 0, 0),
        ]
        noise = [self._dice.randbytes(self._dice.randrange(200)) for _ in range(14)]
        for socket in self._sockets:
            for data in forged + noise:
                try:
                    socket.send(data, zmq.NOBLOCK)
                except zmq.ZMQError:  # It is full, or waits for an answer that never comes.
                    break

    def close(self):
        for socket in self._sockets:
            socket.close()
        self._context.term()


@pytest.mark.slow
def test_the_log_is_that_of_an_undisturbed_run():
    scenario, plan = sampled("base")
    undisturbed, book = simulate(scenario, plan, small_maps()), local_book(2)
    hostile = Hostile(book)
    try:
        with LocalTeam(scenario, plan, small_maps(), book) as team:
            log = run_world(scenario, plan, book, gone=team.gone, before=hostile.act)
    finally:
        hostile.close()
    assert undisturbed.reached
    assert differences(undisturbed, log) == []
