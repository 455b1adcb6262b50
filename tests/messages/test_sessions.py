"""Sessions begin, end with their connection, pass to a process that starts again, and are never shared."""

import pytest
import zmq

from coop_drake.errors import MessagingError
from coop_drake.messages import SUPERVISOR, Effort, Hello, Present, Question, Ready, Switch
from coop_drake.messages.agreement import OTHER_VERSION
from coop_drake.messages.codec import VERSION, encode
from coop_drake.messages.schema import TurnedAway
from coop_drake.messages.wire import KINDS
from tests.support.message_pairs import LIMIT, QUESTION, Pairs


@pytest.fixture
def pairs():
    pairs = Pairs()
    yield pairs
    pairs.close()


def test_a_name_that_is_being_heard_is_not_given_away(pairs):
    first, second = pairs.connect(0), pairs.client(0)
    pairs.settle(lambda: "being heard" in second.trouble, first, second)
    assert (first.session, second.session) == (pairs.server.peers[0].session, 0)


def test_a_silent_process_loses_its_name_and_what_it_says_later_is_refused(pairs):
    first, second = pairs.connect(0), pairs.client(0)
    pairs.settle(lambda: second.session, second)  # Within the half second that silence takes.
    pairs.settle(lambda: pairs.server.peers[0].session == second.session, second)
    assert pairs.server.peers[0].sessions == 2
    assert first.send(Ready(1, True))
    assert pairs.refused(1) == {"SESSION": 1}


def test_a_process_that_is_gone_can_start_again_at_once(pairs):
    first = pairs.connect(0)
    first.close()
    pairs.settle(lambda: not pairs.server.send(0, Switch(1, 2)))
    assert pairs.server.peers[0].unsent == 1
    again = pairs.connect(0)
    assert (pairs.server.peers[0].sessions, pairs.server.peers[0].sent) == (2, 0)
    assert pairs.server.send(0, Switch(1, 2))
    assert again.receive(LIMIT) == Switch(1, 2)


def test_the_first_message_of_a_session_is_that_the_process_is_there(pairs):
    client = pairs.client(1)
    while (taken := pairs.server.receive(0.01)) is None:
        client.poll()
    assert taken == (1, Present())


@pytest.mark.parametrize(
    ("question", "words"), [(Question(9, 2), "another scenario"), (Question(1, 9), "another plan")]
)
def test_who_has_another_scenario_or_plan_is_turned_away(pairs, question, words):
    other = pairs.client(0, question=question)
    pairs.settle(lambda: words in other.trouble, other)
    assert not other.session


def test_a_client_finds_a_server_that_starts_again(pairs):
    client, old = pairs.connect(0), pairs.server
    old.close()
    again = Pairs(address=old.address)
    pairs.server = again.server
    pairs.settle(lambda: client.sessions == 2, client)
    assert client.send(Ready(5, True))
    assert pairs.settle(lambda: again.server.peers[0].incoming.received == 2) == [(0, Ready(5, True))]


def test_what_nobody_reads_is_not_kept_for_ever():
    with zmq.Context() as context:
        pairs = Pairs(address="inproc://team", context=context)
        try:
            client = pairs.connect(0)
            sent = 0
            while pairs.server.send(0, Switch(sent, 0)):
                sent += 1
            assert sent <= 2000  # Two queues of a thousand.
            assert pairs.server.peers[0].unsent == 1
            heard = 0
            while client.poll() is not None:
                heard += 1
            assert (heard, client.incoming.lost) == (sent, 0)
            while client.send(Ready(1, True)):
                sent += 1
            assert client.unsent == 1
        finally:
            pairs.close()


def test_nothing_is_sent_without_a_session(pairs):
    client = pairs.client(0)
    assert not client.send(Effort(1, 0.0, 0, 0, ()))
    assert not pairs.server.send(0, Switch(1, 2))
    assert (client.unsent, pairs.server.peers[0].unsent) == (1, 1)


def test_an_address_that_is_taken_is_named(pairs):
    with pytest.raises(MessagingError, match=f"{pairs.server.address}: cannot listen there: address already"):
        Pairs(address=pairs.server.address)


def test_a_process_that_asks_again_before_it_reads_the_answer_gets_one_session(pairs):
    client = pairs.client(0)
    hello = encode(Hello(client._nonce, *QUESTION), 0, 0, 0)
    for _ in range(3):
        pairs.settle(lambda: client._put(hello))
    peer = pairs.server.peers[0]
    pairs.settle(lambda: peer.incoming.received and peer.session == client.session, client)
    client._put(hello)
    assert client.send(Ready(1, True))
    assert pairs.settle(lambda: peer.incoming.received == 2, client) == [(0, Ready(1, True))]
    assert peer.sessions == client.sessions == 1
    assert (pairs.server.refusals.total, client.refusals.total) == (0, 0)


def test_a_process_of_another_version_is_turned_away_by_that_reason_in_its_own_words(pairs):
    """Headers that open sessions, the nonce and ``TurnedAway`` are the same in all versions."""
    old = pairs.stranger()
    hello = bytearray(encode(Hello(77, *QUESTION), 0, 0, 0))
    hello[3] = VERSION - 1
    old.send(bytes(hello + b"a field that this version does not know"))
    while not old.poll(20):
        pairs.server.receive(0.01)
    answer = old.recv()
    assert answer[3] == VERSION - 1
    assert answer[0] == KINDS[TurnedAway].code
    assert answer[5:] == (77).to_bytes(4, "little") + bytes([OTHER_VERSION])
    assert pairs.refused(1) == {"VERSION": 1}


def test_a_process_that_hears_another_version_says_so(pairs):
    client = pairs.client(0)
    answer = bytearray(encode(TurnedAway(5, OTHER_VERSION), SUPERVISOR, 0, 0))
    answer[3] = VERSION + 1
    client._take([zmq.Frame(bytes(answer))])
    assert client.trouble == "it speaks another version of the protocol"
