"""The exchange of samples with processes whose answers tests choose; who is missing; faults of messages."""

from collections import deque

import msgspec
import numpy as np
import pytest

from coop_drake.answers.budget import Budget
from coop_drake.apart import messages as msg
from coop_drake.apart.faults import ChannelFaults, Faults, Gap, load_faults
from coop_drake.apart.membership import Membership, Processes
from coop_drake.apart.node import FOLLOWS, OUTSIDE, STANDS
from coop_drake.apart.processes import tolerated_age
from coop_drake.apart.team_files import local_book
from coop_drake.apart.transport import Network, Session
from coop_drake.apart.world import Pacing, SampleExchange
from coop_drake.errors import ScenarioError
from coop_drake.laws.actuators import Brake
from coop_drake.scenario import Deployment
from coop_drake.scenario.deployment import Measurements

PERIOD = 0.005
MEASURED = [np.zeros(2 * 3 + 3)]


class Team:
    """Stands in for the world's sockets; answers at once, or later where it is told to."""

    def __init__(self):
        self.questions, self.answers, self.late = [], deque(), False
        self.refusals, self.sample = msg.Refusals(), 0

    def release(self):
        return {}

    def present(self):
        return {0, msg.SUPERVISOR}

    def send(self, index, question):
        if isinstance(question, msg.Welcome):
            return True
        if isinstance(question, msg.Sample):
            self.questions.append(question)
        now = [] if self.late and index == 0 else self.answers
        number, time = question.number, question.time
        if index == msg.SUPERVISOR:
            now.append((index, msg.Status(number, time, True, (0,), 0, 0.0, False, (), 0)))
        else:
            if question.step:
                now.append((0, msg.Effort(number, time, (0, 0), 0, (float(number), 0.0, 0.0), ())))
            now.append((0, msg.Telemetry(number, time, (0, 0), 0, 0, (time,))))
        return True

    def receive(self, limit):
        return self.answers.popleft() if self.answers else None


def made(team, **options):
    exchange = SampleExchange(team, Network(local_book(1), period=PERIOD), 3, **options)
    exchange.brakes = [Brake(np.ones(3), np.full(2, np.inf))]
    return exchange


@pytest.fixture
def team():
    return Team()


@pytest.fixture
def exchange(team):
    return made(team, pacing=Pacing(allowed=0.01), tolerated=0.0)


def test_everybody_is_asked_without_consequence_before_the_first_sample(team, exchange):
    exchange.look(0.0, MEASURED)
    assert [question.step for question in team.questions] == [False] * 20 + [True]
    assert exchange.step(0.0, MEASURED)[0][0] == 0.0


def begun(exchange):
    exchange.look(0.0, MEASURED)
    exchange.step(0.0, MEASURED)


def test_a_robot_that_is_late_for_the_log_between_two_samples_is_not_missing(team, exchange):
    begun(exchange)
    team.late = True
    shown = exchange.look(0.002, MEASURED)
    assert shown[0] == 0.0
    assert not exchange.missing
    team.late = False
    team.answers.append(
        (0, msg.Telemetry(1, 0.002, (0, 0), 0, 0, (0.002,)))
    )  # It comes after the next question.
    shown = exchange.look(PERIOD, MEASURED)
    assert shown[0] == PERIOD
    assert exchange.step(PERIOD, MEASURED)[0][0] == 1.0
    assert not exchange.missing
    assert not exchange.stopped()


def test_a_robot_that_is_late_for_a_sample_is_missing_and_the_drives_brake(team, exchange):
    begun(exchange)
    team.late = True
    exchange.look(PERIOD, MEASURED)
    assert exchange.missing == {0: 0.0}
    assert exchange.facts()["processes"][0] | {"age": 0.0} == {
        "name": "robot 0", "state": "silent", "missing_since": 0.0,
        "team_messages": 0, "refused": 0, "age": 0.0,
    }  # fmt: skip
    exchange.step(PERIOD, MEASURED)
    exchange.look(2 * PERIOD, MEASURED)
    assert exchange.stopped()


def test_drives_take_no_effort_that_rests_on_measurements_of_the_future_or_of_long_ago(team):
    exchange = made(team, pacing=Pacing(allowed=0.01), oldest=0.02)
    exchange.look(0.0, MEASURED)
    assert exchange.step(0.0, MEASURED)[0][0] == 0.0
    for stamp in (0.5, -0.1, float("nan")):
        before = team.refusals.counts[msg.Reason.STAMP]
        exchange._keep(0, msg.Effort(0, stamp, (0, 0), 0, (9.0, 9.0, 9.0), ()), admits=True)
        assert team.refusals.counts[msg.Reason.STAMP] == before + 1
    assert exchange.step(PERIOD, MEASURED)[0][0] == 1.0


GOOD, STATUS = (
    msg.Effort(0, 0.0, (0, 1), 0, (1.0, 2.0, 3.0), ()),
    msg.Status(0, 0.0, True, (0,), 0, 0.0, False, (), 0),
)


@pytest.mark.parametrize(
    ("sender", "wrong"),
    [
        (0, msgspec.structs.replace(GOOD, efforts=(1e3,))),
        (0, msgspec.structs.replace(GOOD, rest=(1e3,) * 40)),
        (0, msgspec.structs.replace(GOOD, number=2**32 - 1)),
        (0, msgspec.structs.replace(GOOD, state=9)),
        (msg.SUPERVISOR, msgspec.structs.replace(STATUS, team_messages=())),
        (msg.SUPERVISOR, msgspec.structs.replace(STATUS, causes=(1, 2, 3, 4))),
        (msg.SUPERVISOR, msgspec.structs.replace(STATUS, cell=3)),
    ],
)
def test_an_answer_that_is_well_formed_and_does_not_fit_changes_nothing(team, sender, wrong):
    team.answers.append((sender, wrong))
    exchange = made(team)
    assert exchange.step(0.0, MEASURED)[0].tolist() == [0.0, 0.0, 0.0]
    assert exchange.look(0.002, MEASURED)[1:].tolist() == [0.0, 0.0, 0.0]
    assert exchange.facts()["processes"][0]["state"] == "follows the plan"
    assert team.refusals.counts == {msg.Reason.VALUE: 1}
    assert not exchange.missing


class Book(Processes):
    """A membership, with who has ended, what was revived and what was told."""

    def __init__(self, *, restarts=0, rejoin=60.0, **options):
        self.ended, self.told, self.restarts = set(), [], restarts
        self.membership = Membership(rejoin=rejoin, **options, processes=self, tell=self.told.append)

    def gone(self):
        return self.ended

    def revive(self, index):
        if not self.restarts:
            return False
        self.restarts -= 1
        self.ended.discard(index)
        return True


def test_the_drives_brake_once_a_robot_is_missing_for_longer_than_is_tolerated():
    book = Book()
    book.membership.lose({1: 0.39})
    book.membership.see(0.40, {0: FOLLOWS}, rests=False)
    assert not book.membership.stopped
    book.membership.see(0.42, {0: FOLLOWS}, rests=False)
    assert book.membership.stopped
    assert book.told == ["robot 1 has not answered since t = 0.39 s"]
    book.membership.back(1)
    book.membership.see(0.9, {0: STANDS, 1: STANDS}, rests=True)
    book.membership.close_line(1.1, returns=False)
    assert book.membership.facts()["stops"] == [
        {"cause": "robot 1", "since": 0.42, "rested": 0.9, "resumed": 1.1, "returned": False}
    ]
    assert book.told[1:] == ["robot 1 is there again", "the team goes on at t = 1.1 s"]


@pytest.mark.parametrize(("planned", "tolerated"), [(None, 0.02), (0.01, 0.0), (0.025, 0.015), (0.005, 0.0)])
def test_a_budget_tolerates_what_its_delay_leaves_beside_that_of_measurements(planned, tolerated):
    deployment = Deployment(control_rate=200.0, measurements=Measurements(delay=0.01))
    found = tolerated_age(deployment, None if planned is None else Budget(delay=planned))
    assert found == pytest.approx(tolerated)


@pytest.mark.parametrize(("rejoin", "ended"), [(0.0, set()), (60.0, {1})])
def test_a_team_at_rest_waits_neither_for_ever_nor_for_who_does_not_come_back(rejoin, ended):
    book = Book(rejoin=rejoin)
    book.ended = ended
    book.membership.lose({1: 0.39})
    book.membership.see(0.5, {}, rests=False)
    assert not book.membership.trouble
    book.membership.see(1.0, {}, rests=True)
    assert book.told[-1] == f"the team rests and waits for robot 1 for at most {rejoin:g} s"
    assert (
        book.membership.trouble == "robot 1 has not answered since t = 0.39 s; the team rests since t = 1 s"
    )


def test_who_has_ended_is_started_again_as_often_as_allowed():
    book = Book(restarts=2)
    book.ended = {1}
    book.membership.lose({1: 0.39})
    assert book.told == ["robot 1 has not answered since t = 0.39 s; it is started again"]
    for time, trouble in ((1.0, False), (1.1, True)):
        book.ended = {1}
        book.membership.see(time, {}, rests=True)
        assert bool(book.membership.trouble) == trouble
    assert book.membership.facts()["restarts"] == {"robot 1": 2}


def test_a_team_that_rests_outside_its_cell_ends_the_run():
    book = Book()
    book.membership.see(0.4, {0: STANDS, 1: STANDS}, rests=False)
    for time, trouble in ((0.8, ""), (1.2, ""), (1.4, "robot 1 cannot begin")):
        book.membership.see(time, {0: STANDS, 1: OUTSIDE}, rests=True)
        assert book.membership.trouble.startswith(trouble)
        assert bool(book.membership.trouble) == bool(trouble)
    assert book.membership.trouble.endswith("the team rests since t = 0.8 s")


STEP = 0.01


def sending(faults, messages, sender=0, receiver=msg.SUPERVISOR):
    """Numbers of the messages that leave at each sample, one message being sent at each."""
    left, now = [], []

    def put(data):
        now.append(msgspec.msgpack.decode(data)[1])
        return True

    session = Session(put, Network(local_book(2), faults=faults, period=STEP).link(sender, receiver))
    session.begin(1, is_open=True)
    for sample, message in enumerate(messages):
        session.send(message, sample)
        session.release(sample)
        left.append(tuple(now))
        now.clear()
    return left, session.sent


def reports(count):
    return [msg.Ready(cell, True) for cell in range(count)]


def test_every_message_has_its_own_fate_by_the_seed():
    faults = [Faults(seed=seed, team=ChannelFaults(loss=0.3, repeat=0.3)) for seed in (1, 1, 2)]
    first, again, other = (sending(fault, reports(200)) for fault in faults)
    assert first == again
    assert first != other
    counts = [len(numbers) for numbers in first[0]]
    assert 40 < counts.count(0) < 80
    assert 25 < counts.count(2) < 65
    assert first[1] == 200 - counts.count(0)
    assert sending(faults[0], reports(200), sender=1) != first


def test_late_messages_leave_after_what_is_sent_then_and_count_where_nothing_has_overtaken_them():
    faults = Faults(team=ChannelFaults(late=1.0, late_by=0.015))
    assert sending(faults, reports(6)) == ([(1,), (), (), (2,), (3,), (4,)], 4)
    mixed, sent = sending(Faults(seed=3, team=ChannelFaults(late=0.5, late_by=0.03)), reports(40))
    order = [number for numbers in mixed for number in numbers]
    assert order != sorted(order)
    assert sent == sum(number > max(order[:k], default=0) for k, number in enumerate(order))


def test_nothing_passes_a_gap_but_what_the_log_needs():
    gap = Gap(0.02, 0.03, robots=(0,))
    samples = [msg.Sample(k, k * STEP, True, False, (), 0.0, 0.0, (), ()) for k in range(8)]
    faults = Faults(sensors=ChannelFaults(gaps=(gap,)), efforts=ChannelFaults(gaps=(gap,)))
    assert sending(faults, samples, msg.WORLD, 0)[0] == [(1,), (2,), (), (), (), (6,), (7,), (8,)]
    assert sending(faults, samples, msg.WORLD, 1)[1] == 8
    looks = [msgspec.structs.replace(sample, step=False) for sample in samples]
    assert sending(faults, looks, msg.WORLD, 0)[1] == 8
    assert sending(faults, [msg.Effort(k, 0.0, (), 0, (), ()) for k in range(8)], 0, msg.WORLD)[1] == 5
    assert sending(faults, [msg.Telemetry(k, 0.0, (), 0, 0, ()) for k in range(8)], 0, msg.WORLD)[1] == 8
    assert sending(faults, [msg.Welcome()] * 8, msg.WORLD, 0)[0] == [(0,)] * 8


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("team: {loss: 1.5}", "team.loss"),
        ("sensors: {gaps: [{begin: 1, duration: 1, robots: [2]}]}", r"sensors.gaps\[0\].robots"),
        ("clocks: [{robot: 7, offset: 0.1}]", r"clocks\[0\].robot"),
    ],
)
def test_a_file_is_read_and_a_wrong_one_refused_with_its_key(tmp_path, text, key):
    path = tmp_path / "faults.yaml"
    path.write_text("seed: 3\nteam: {loss: 0.2, gaps: [{begin: 1, duration: 0.5}]}\n")
    expected = Faults(seed=3, team=ChannelFaults(loss=0.2, gaps=(Gap(1.0, 0.5),)))
    assert load_faults(path, 2) == expected
    path.write_text(text)
    with pytest.raises(ScenarioError, match=f"faults.yaml.*{key}"):
        load_faults(path, 2)
