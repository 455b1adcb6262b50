"""A world, a supervisor and two robots in one process speak through real sockets, beside whoever disturbs."""

import os
import random
import signal
from contextlib import ExitStack
from dataclasses import replace
from itertools import permutations
from math import inf
from multiprocessing import get_context
from socket import create_connection
from time import monotonic

import msgspec
import pytest
import zmq

from coop_drake.apart import messages as msg
from coop_drake.apart.faults import ChannelFaults, Faults
from coop_drake.apart.team_files import local_book, make_keys
from coop_drake.apart.transport import Ends, Network
from coop_drake.errors import MessagingError, ScenarioError

LIMIT = 10.0
"""Longest time that a test waits for what must come [s]."""

EFFORT = msg.Effort(1, 0.0, (), 0, (1.0, 2.0, 3.0), ())


class Team:
    """A world, and whatever a test connects to it; all are polled in turn by one thread."""

    def __init__(self, keys=None):
        self.keys, self.opened = keys or {}, []
        self.book = local_book(2, self.keys)
        self.world = self.join(msg.WORLD)

    def join(self, index, *, keys=None, **changes):
        """The ends of a process, which have not asked for sessions yet."""
        network = Network(self.book, "scenario", "plan", keys or self.keys.get(index))
        ends = Ends(replace(network, **changes), index)
        self.opened.append(ends)
        return ends

    def settle(self, done, *others):
        """Poll all until something holds; return what the world heard meanwhile, without sessions."""
        heard, end = [], monotonic() + LIMIT
        while not done():
            assert monotonic() < end, [other.clients[msg.WORLD].trouble for other in others]
            for other in others:
                other.receive()
            if (taken := self.world.receive(0.002)) and not isinstance(taken[1], msg.Hello):
                heard.append(taken)
        return heard

    def connect(self, index, **changes):
        """The ends of a process that has a session with the world."""
        ends = self.join(index, **changes)
        self.settle(lambda: ends.sessions[msg.WORLD].open and index in self.world.present(), ends)
        return ends

    def stranger(self):
        """A bare socket that is connected to the world."""
        socket = zmq.Context.instance().socket(zmq.DEALER)
        socket.linger = 0
        socket.connect(self.book.world.address)
        self.opened.append(socket)
        return socket

    def refused(self, count):
        """Poll the world until it has refused so many messages; return how many of each reason."""
        counts = self.world.refusals.counts
        self.settle(lambda: counts.total() >= count)
        return {reason.name: number for reason, number in counts.items()}

    def works_for(self, robot):
        """An effort and a measurement cross, whatever else has been sent."""
        assert robot.send(msg.WORLD, EFFORT)
        assert news(self.world) == (0, EFFORT)
        number = self.world.sent(0)
        assert self.world.send(0, msg.Sample(number, 0.0, True, False, (), 0.0, 0.0, (), ()))
        assert news(robot)[1].number == number

    def close(self):
        for opened in self.opened:
            opened.close()


@pytest.fixture
def team():
    team = Team()
    yield team
    team.close()


@pytest.fixture(scope="module")
def team_keys():
    return {index: make_keys() for index in (0, 1, msg.SUPERVISOR, msg.WORLD)}


@pytest.fixture
def secured(team_keys):
    team = Team(team_keys)
    yield team
    team.close()


def news(ends):
    """The next message that is not about sessions, with its sender."""
    while isinstance((taken := ends.receive(LIMIT))[1], msg.Hello | msg.Welcome):
        pass
    return taken


def session_of(ends):
    return ends.sessions[msg.WORLD].number


def test_who_does_not_answer_is_named_with_its_address_and_nothing_is_sent_to_it(team):
    robot = team.join(0)
    address = team.book.supervisor.address
    with pytest.raises(MessagingError, match=f"the supervisor at {address}: nothing answers there"):
        robot.open(0.05)
    assert not robot.send(msg.SUPERVISOR, msg.Ready(1, ready=True))
    assert not team.world.send(1, msg.Goodbye(0))
    assert (robot.sent(msg.SUPERVISOR), team.world.sent(1)) == (0, 0)


def test_an_address_that_is_taken_is_named(team):
    with pytest.raises(
        MessagingError, match=f"{team.book.world.address}: cannot listen there: address already"
    ):
        team.join(msg.WORLD)


def test_a_name_belongs_to_one_connection_until_that_is_gone(team):
    first, second = team.connect(0), team.join(0)
    client = second.clients[msg.WORLD]
    team.settle(lambda: client.trouble == "another process of this name is connected", first, second)
    team.works_for(first)
    assert team.world.sent(0) == 1
    first.close()
    team.settle(lambda: client.session.open, second)
    assert team.world.sent(0) == 0
    team.works_for(second)


def _stay(network):
    ends = Ends(network, 0)
    while True:
        ends.receive(1.0)


@pytest.mark.slow
def test_a_process_that_is_stopped_loses_its_name_after_two_seconds(team):
    others = Network(team.book, "scenario", "plan")
    process = get_context("fork").Process(target=_stay, args=(others,), daemon=True)
    process.start()
    try:
        team.settle(lambda: 0 in team.world.present())
        os.kill(process.pid, signal.SIGSTOP)
        begin, second = monotonic(), team.join(0)
        team.settle(lambda: second.sessions[msg.WORLD].open, second)
        assert 1.0 < monotonic() - begin < 6.0
        os.kill(process.pid, signal.SIGCONT)
        team.settle(lambda: team.world.refusals.counts[msg.Reason.SESSION] > 2, second)
        team.works_for(second)
    finally:
        process.kill()
        process.join()


def test_robots_of_a_team_that_passes_speak_to_each_other_and_wait_for_each_other(team):
    ends = {k: team.join(k, passes=True) for k in (msg.SUPERVISOR, 0, 1)}
    with pytest.raises(MessagingError, match="no message came from robot 0"):
        ends[1].open(0.05)
    team.settle(lambda: all(len(each.present()) == 3 for each in ends.values()), *ends.values())
    word = msg.Word((1.0, 0.0, 0.5, 2.0, 3.0, inf, 0.0, inf, 1.0))
    for sender, receiver in permutations(ends, 2):
        assert ends[sender].send(receiver, word)
        assert news(ends[receiver]) == (sender, word)
    assert not any(each.refusals.total for each in ends.values())


def test_robots_without_addresses_cannot_pass(team):
    robots = tuple(replace(robot, address=None) for robot in team.book.robots)
    with pytest.raises(ScenarioError, match=r"robots\[1\].address"):
        team.join(0, passes=True, book=replace(team.book, robots=robots))


def test_the_first_messages_are_those_of_the_session_which_begins_once(team):
    robot = team.join(0)
    while (taken := team.world.receive(0.01)) is None:
        robot.receive()
    assert taken == (0, msg.Hello(msg.PROTOCOL, 0, "scenario", "plan"))
    assert robot.receive(LIMIT) == (msg.WORLD, msg.Welcome())
    for _ in range(3):  # As where the answer takes long.
        robot.sessions[msg.WORLD].tell(taken[1])
    team.works_for(robot)
    assert (robot.sessions[msg.WORLD].count, team.world.refusals.total, robot.refusals.total) == (1, 0, 0)


@pytest.mark.parametrize(
    ("hello", "words", "reason"),
    [
        (msg.Hello(msg.PROTOCOL, 0, "another", "plan"), "it has another scenario", "SESSION"),
        (msg.Hello(msg.PROTOCOL, 0, "scenario", "another"), "it has another plan", "SESSION"),
        (msg.Hello(msg.PROTOCOL, 7, "scenario", "plan"), "it knows no process of this name", "SENDER"),
        (
            {"type": "Hello", "protocol": 8, "name": "arm"},
            f"it speaks protocol {msg.PROTOCOL}, not 8",
            "VERSION",
        ),
        (msg.Hello(4, 0, "scenario", "plan"), f"it speaks protocol {msg.PROTOCOL}, not 4", "VERSION"),
    ],
)
def test_who_gets_no_session_is_told_why(team, hello, words, reason):
    stranger = team.stranger()
    stranger.send(msgspec.msgpack.encode((77, 0, hello)))
    assert team.refused(1) == {reason: 1}
    assert msgspec.msgpack.decode(stranger.recv()) == [77, 0, {"type": "Refused", "reason": words}]
    assert not team.world.present()


def test_a_client_that_is_refused_says_why_and_asks_again(team):
    robot = team.join(0, plan="another")
    team.settle(lambda: team.world.refusals.total > 1, robot)
    with pytest.raises(MessagingError, match=r"the world at .*: it has another plan"):
        robot.open(0.2)


def test_a_client_finds_a_server_that_starts_again_and_counts_anew(team):
    robot = team.connect(0)
    team.works_for(robot)
    before = session_of(robot)
    team.world.close()
    team.world = team.join(msg.WORLD)
    team.settle(lambda: robot.sessions[msg.WORLD].count == 2 and 0 in team.world.present(), robot)
    assert session_of(robot) != before
    assert robot.sent(msg.WORLD) == 0
    team.works_for(robot)


def test_messages_of_another_session_or_with_a_passed_number_are_refused(team):
    robot, stranger, other = team.connect(0), team.stranger(), team.connect(1)
    team.works_for(robot)
    session, data = session_of(robot), msg.encode(session_of(robot), 1, EFFORT)
    stranger.send(data)  # As it was heard on another connection.
    other.sessions[msg.WORLD]._put(msg.encode(session, 1, EFFORT))
    robot.sessions[msg.WORLD]._put(msg.encode(session ^ 1, 2, EFFORT))
    assert team.refused(3) == {"SESSION": 3}
    robot.sessions[msg.WORLD]._put(data)
    assert team.refused(4) == {"SESSION": 3, "SEQUENCE": 1}
    team.works_for(robot)
    sample = msg.Sample(9, 0.0, True, False, (), 0.0, 0.0, (), ())
    for number, own in ((1, session), (5, session ^ 1)):
        team.world.sessions[0]._put(msg.encode(own, number, sample))
    team.settle(lambda: robot.refusals.total == 2, robot)
    assert robot.refusals.counts == {msg.Reason.SEQUENCE: 1, msg.Reason.SESSION: 1}


def test_malformed_messages_are_refused_counted_and_said_once_and_all_go_on(team, capfd):
    robot, stranger, dice = team.connect(0), team.stranger(), random.Random(1)
    good = msg.encode(session_of(robot), 1, EFFORT)
    bad = [dice.randbytes(dice.randrange(60)) for _ in range(40)] + [good[:k] for k in range(len(good))]
    bad += [msg.encode(session_of(robot), 1, msg.Ready(1, ready=True)), b"\x91" * 60_000]
    for data in bad:
        stranger.send(data)
        robot.sessions[msg.WORLD]._put(data)
    stranger.send_multipart([good, good, good])
    assert team.refused(2 * len(bad) + 1) == {"SESSION": len(bad), "MALFORMED": len(bad) + 1}
    assert capfd.readouterr().err.count("the world refused a message, and goes on: ") == 1
    team.works_for(robot)


def test_a_message_that_is_too_long_closes_its_connection(team):
    robot, stranger = team.connect(0), team.stranger()
    stranger.send(bytes(msg.LONGEST + 1))

    def heard_again():  # What is sent before the connection is open again goes with the one that was closed.
        stranger.send(b"\4")
        return team.world.refusals.total > 0

    team.settle(heard_again)
    assert set(team.refused(1)) == {"SESSION"}
    team.works_for(robot)


def test_connections_that_do_not_speak_zeromq_do_no_harm(team):
    robot, dice = team.connect(0), random.Random(1)
    place = ("127.0.0.1", int(team.book.world.address.rpartition(":")[2]))
    with ExitStack() as opened:
        for number in range(60):
            connection = opened.enter_context(create_connection(place))
            if number % 3 == 0:  # The others stay silent.
                connection.sendall(b"GET / HTTP/1.1\r\n\r\n" + dice.randbytes(200))
        team.works_for(robot)
    team.works_for(robot)
    assert robot.sessions[msg.WORLD].count == 1


def test_a_peer_that_floods_takes_turns_with_the_others_and_is_not_kept_for_ever(team):
    robot, flooder = team.connect(0), team.connect(1)
    shown = msg.Telemetry(1, 0.0, (), 0, 0, (0.0,) * msg.MOST_ITEMS)
    sent = 0
    while flooder.send(msg.WORLD, shown):
        sent += 1
    assert sent < 4000  # Two queues of a thousand, and what the system keeps for a connection.
    assert robot.send(msg.WORLD, EFFORT)
    before = 0
    while team.world.receive(LIMIT) != (0, EFFORT):
        before += 1
    assert before < sent / 2
    for _ in range(sent - before):
        assert news(team.world) == (1, shown)


def test_both_ends_count_what_is_lost_repeated_and_late(team):
    faults = Faults(seed=1, efforts=ChannelFaults(loss=0.3, repeat=0.5, late=0.2, late_by=0.02))
    robot = team.connect(0, faults=faults, period=0.01)
    for sample in range(60):
        robot.sample = sample
        robot.send(msg.WORLD, msg.Effort(sample, 0.0, (), 0, (), ()))
        robot.release()
    count = robot.sent(msg.WORLD)
    heard = [team.world.receive(LIMIT)[1].number for _ in range(count)]
    assert 20 < count < 50
    assert heard == sorted(set(heard))
    assert team.world.receive(0.05) is None
    assert set(team.world.refusals.counts) == {msg.Reason.SEQUENCE}


@pytest.mark.parametrize(
    ("keys", "words", "reason"),
    [
        ("none", "", "HANDSHAKE"),
        ("unknown", "the connection was refused: a key is missing or wrong", "HANDSHAKE"),
        ("of robot 1", "its address book has another key for this name", "SENDER"),
        ("for another world", "", "HANDSHAKE"),
    ],
)
def test_a_key_speaks_for_its_own_process_alone_to_its_own_world(secured, team_keys, keys, words, reason):
    robot = secured.connect(0)
    if keys == "none":
        secured.stranger().send(msg.encode(5, 0, msg.Hello(msg.PROTOCOL, 1, "scenario", "plan")))
        secured.settle(lambda: secured.world.refusals.total > 0)
    else:
        book = local_book(2, team_keys | {msg.WORLD: make_keys()})
        other = replace(book, world=replace(book.world, address=secured.book.world.address))
        changes = {
            "unknown": {"keys": make_keys()},
            "of robot 1": {"keys": team_keys[1]},
            "for another world": {"book": other},
        }
        thief = secured.join(0 if keys == "of robot 1" else 1, **changes[keys])
        client = thief.clients[msg.WORLD]
        secured.settle(lambda: secured.world.refusals.total > 0 and words in client.trouble, thief)
        assert not client.session.open
    assert {why.name for why in secured.world.refusals.counts} == {reason}
    assert secured.world.present() == {0}
    secured.works_for(robot)
