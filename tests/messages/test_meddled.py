"""Messages that are lost, late or doubled between two processes: what arrives, and what is counted."""

import pytest

from coop_drake.messages import MessageClient, Ready
from coop_drake.messages.schema import SUPERVISOR
from coop_drake.messages.wire import KINDS
from tests.support.meddler import Meddler, delay, double, lose
from tests.support.message_pairs import QUESTION, Pairs

READY = KINDS[Ready].code


@pytest.mark.parametrize(
    ("rule", "cells", "lost", "refused"),
    [
        (lose(lambda number: number in (2, 3)), [0, 1, 4, 5, 6, 7, 8, 9], 2, 0),
        (double(lambda number: number % 2 == 0), list(range(10)), 0, 5),
        (delay(lambda number: number == 3, 2), [0, 1, 2, 4, 5, 6, 7, 8, 9], 1, 1),
    ],
    ids=["lost", "doubled", "late"],
)
def test_what_arrives_of_ten_reports(rule, cells, lost, refused):
    pairs = Pairs()
    meddler = Meddler(pairs.server.address, {READY: rule})
    client = MessageClient(meddler.address, SUPERVISOR, channel="team", sender=0, question=QUESTION)
    try:
        peer = pairs.server.peers[0]
        pairs.settle(lambda: client.session and peer.session == client.session, client)
        for cell in range(10):
            client.send(Ready(cell, True))
        heard = pairs.settle(lambda: peer.incoming.last == 11 and pairs.server.refusals.total >= refused)
        assert [message.cell for _, message in heard] == cells
        assert (peer.incoming.lost, pairs.server.refusals.total) == (lost, refused)
    finally:
        client.close()
        meddler.close()
        pairs.close()
