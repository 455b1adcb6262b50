"""Strangers, replayed, reordered, malformed messages and floods are refused and counted."""

import random
from contextlib import ExitStack
from socket import create_connection

import pytest

from coop_drake.messages import Effort, Hello, Ready, Switch, make_keys
from coop_drake.messages.codec import LONGEST, encode
from coop_drake.messages.incoming import BURST, Incoming
from coop_drake.messages.refusals import RefusedError
from coop_drake.messages.schema import SUPERVISOR, Welcome
from tests.support.message_pairs import LIMIT, Pairs


@pytest.fixture
def pairs():
    pairs = Pairs()
    yield pairs
    pairs.close()


def exchange(pairs, honest, cell=1):
    """A report and a switch cross, whatever else has been sent."""
    assert honest.send(Ready(cell, True))
    heard = pairs.settle(lambda: pairs.server.peers[0].incoming.last == honest.sent)
    assert heard == [(0, Ready(cell, True))]
    assert pairs.server.send(0, Switch(cell + 1, 17))
    assert honest.receive(LIMIT) == Switch(cell + 1, 17)


def test_a_stranger_without_a_session_is_refused(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    stranger.send(encode(Ready(1, True), 0, honest.session, 7))
    assert pairs.refused(1) == {"SESSION": 1}
    exchange(pairs, honest)


def test_a_name_that_is_unknown_or_of_somebody_else_is_refused(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    stranger.send(encode(Hello(5, 1, 2), 9, 0, 0))
    assert pairs.refused(1) == {"SENDER": 1}
    pairs.server.peers[1].last = honest.session  # Sessions are drawn; these two must differ.
    other = pairs.connect(1)
    other._put(encode(Ready(1, True), 0, honest.session, 2))
    assert pairs.refused(2) == {"SENDER": 1, "SESSION": 1}
    exchange(pairs, honest)


def test_replayed_messages_are_refused_on_every_connection(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    exchange(pairs, honest)
    said = [data for way, _, data in pairs.shown if way == "received"]
    for data in said[1:]:  # Without the Hello.
        stranger.send(data)
        honest._put(data)
    assert pairs.refused(4) == {"SESSION": 2, "SEQUENCE": 2}
    exchange(pairs, honest, 2)


def test_a_replayed_hello_gives_no_session_to_a_stranger(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    for data in [data for way, _, data in pairs.shown if way == "received"]:
        stranger.send(data)
    assert pairs.refused(1) == {"SESSION": 1}
    assert pairs.server.peers[0].sessions == 1
    exchange(pairs, honest)


def test_reordered_and_lost_messages_are_counted(pairs):
    honest = pairs.connect(0)
    for sequence in (4, 2, 3, 5):
        honest._put(encode(Ready(sequence, True), 0, honest.session, sequence))
    heard = pairs.settle(lambda: pairs.server.peers[0].incoming.last == 5)
    assert [message.cell for _, message in heard] == [4, 5]
    assert pairs.refused(2) == {"SEQUENCE": 2}
    assert pairs.server.peers[0].incoming.lost == 2
    honest.outgoing.restart(5)
    exchange(pairs, honest)


def test_malformed_messages_are_refused_with_and_without_a_session(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    dice = random.Random(1)
    good = encode(Ready(1, True), 0, honest.session, 2)
    bad = [dice.randbytes(dice.randrange(60)) for _ in range(40)] + [good[:k] for k in range(len(good))]
    for data in bad:
        stranger.send(data)
        honest._put(data)
    stranger.send_multipart([good, good, good])
    honest._put(encode(Effort(1, 0.0, 1, 0, (1.0,)), 0, honest.session, 2))
    counts = pairs.refused(2 * len(bad) + 2)
    assert sum(counts.values()) == 2 * len(bad) + 2
    assert {"LENGTH", "PARTS", "KIND"} <= set(counts)
    honest.outgoing.restart(2)
    exchange(pairs, honest)


def test_a_flood_of_one_robot_is_bounded_and_of_a_stranger_is_passed_over():
    pairs = Pairs(rate=1e-3)
    try:
        honest, flooder, stranger = pairs.connect(0), pairs.connect(1), pairs.stranger()
        for _ in range(BURST + 100):
            assert flooder.send(Ready(1, True))
            pairs.server.receive()
        assert set(pairs.refused(101)) == {"FLOOD"}
        assert pairs.server.peers[1].incoming.received == BURST
        for _ in range(500):
            stranger.send(b"noise")
        exchange(pairs, honest)
    finally:
        pairs.close()


def test_what_a_sender_may_send_grows_with_time():
    incoming = Incoming(rate=10.0)
    for _ in range(BURST):
        incoming.limit(5.0)
    with pytest.raises(RefusedError):
        incoming.limit(5.05)
    incoming.limit(5.15)


def test_a_client_refuses_what_is_not_its_servers(pairs):
    honest = pairs.connect(0)
    route, server = pairs.server.peers[0].route, pairs.server._socket
    switch = Switch(1, 2)
    for data in (
        b"\4",
        encode(Welcome(1, 2), 9, 0, 0),
        encode(switch, SUPERVISOR, honest.session % 255 + 1, 1),
        encode(Ready(1, True), SUPERVISOR, honest.session, 1),
    ):
        server.send_multipart([route, data])
    assert pairs.server.send(0, switch)
    server.send_multipart([route, encode(switch, SUPERVISOR, honest.session, 1)])
    assert honest.receive(LIMIT) == switch
    pairs.settle(lambda: honest.refusals.total == 5, honest)
    reasons = {reason.name for reason in honest.refusals.counts}
    assert reasons == {"LENGTH", "SENDER", "SESSION", "KIND", "SEQUENCE"}


def test_connections_that_do_not_speak_zeromq_do_no_harm(pairs):
    honest, dice = pairs.connect(0), random.Random(1)
    place = ("127.0.0.1", int(pairs.server.address.rpartition(":")[2]))
    with ExitStack() as opened:
        for number in range(60):
            connection = opened.enter_context(create_connection(place))
            if number % 3 == 0:  # The others stay silent.
                connection.sendall(b"GET / HTTP/1.1\r\n\r\n" + dice.randbytes(200))
        exchange(pairs, honest)
    exchange(pairs, honest, 2)
    assert (pairs.server.peers[0].sessions, pairs.server.peers[0].incoming.lost) == (1, 0)


def test_a_message_that_is_too_long_closes_its_connection(pairs):
    honest, stranger = pairs.connect(0), pairs.stranger()
    stranger.send(bytes(LONGEST + 1))

    def heard_again():  # What is sent before the connection is open again goes with the one that was closed.
        stranger.send(b"\4")
        return pairs.server.refusals.total > 0

    pairs.settle(heard_again)
    assert {reason.name for reason in pairs.server.refusals.counts} == {"LENGTH"}
    exchange(pairs, honest)


@pytest.fixture(scope="module")
def team_keys():
    return {index: make_keys() for index in (0, 1, SUPERVISOR)}


@pytest.fixture
def secured(team_keys):
    pairs = Pairs(keys=team_keys)
    yield pairs
    pairs.close()


def test_without_keys_nobody_connects(secured):
    honest, stranger = secured.connect(0), secured.stranger()
    stranger.send(encode(Hello(5, 1, 2), 1, 0, 0))
    secured.settle(lambda: secured.server.refusals.total > 0)
    assert {reason.name for reason in secured.server.refusals.counts} == {"HANDSHAKE"}
    exchange(secured, honest)


def test_an_unknown_key_does_not_connect(secured):
    honest, other = secured.connect(0), secured.client(1, keys=make_keys())
    secured.settle(lambda: "key" in other.trouble, other)
    assert not other.session
    assert {reason.name for reason in secured.server.refusals.counts} == {"HANDSHAKE"}
    exchange(secured, honest)


def test_a_known_key_has_its_own_name_alone(secured, team_keys):
    honest, thief = secured.connect(0), secured.client(0, keys=team_keys[1])
    secured.settle(lambda: "another key" in thief.trouble, thief)
    assert not thief.session
    assert {reason.name for reason in secured.server.refusals.counts} == {"SENDER"}
    exchange(secured, honest)


def test_a_client_does_not_speak_to_a_server_with_another_key(secured):
    honest, careful = secured.connect(0), secured.client(1, server_key=make_keys().public)
    secured.settle(lambda: secured.server.refusals.total > 0, careful)
    assert not careful.session
    assert {reason.name for reason in secured.server.refusals.counts} == {"HANDSHAKE"}
    exchange(secured, honest)
