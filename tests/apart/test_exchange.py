"""The exchange of samples, with processes whose answers the test chooses."""

from collections import deque

import msgspec
import numpy as np
import pytest

from coop_drake.apart.messages import SUPERVISOR, Effort, Reason, Refusals, Sample, Status, Telemetry, Welcome
from coop_drake.apart.team_files import local_book
from coop_drake.apart.transport import Network
from coop_drake.apart.world import Pacing, SampleExchange
from coop_drake.laws.actuators import Brake

PERIOD = 0.005
MEASURED = [np.zeros(2 * 3 + 3)]


class Team:
    """Stands in for the world's sockets; answers at once, or later where it is told to."""

    def __init__(self):
        self.questions, self.answers, self.late = [], deque(), False
        self.refusals, self.sample = Refusals(), 0

    def release(self):
        return {}

    def present(self):
        return {0, SUPERVISOR}

    def send(self, index, question):
        if isinstance(question, Welcome):
            return True
        if isinstance(question, Sample):
            self.questions.append(question)
        now = [] if self.late and index == 0 else self.answers
        number, time = question.number, question.time
        if index == SUPERVISOR:
            now.append((index, Status(number, time, True, (0,), 0, 0.0, False, (), 0)))
        else:
            if question.step:
                now.append((0, Effort(number, time, 0, 0, (float(number), 0.0, 0.0), ())))
            now.append((0, Telemetry(number, time, 0, 0, 0, (time,))))
        return True

    def receive(self, limit):
        return self.answers.popleft() if self.answers else None


def made(team, **options):
    exchange = SampleExchange(team, Network(local_book(1), period=PERIOD), **options)
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


def test_a_robot_that_is_late_for_the_log_between_two_samples_is_not_missing(team, exchange):
    exchange.look(0.0, MEASURED)
    exchange.step(0.0, MEASURED)
    team.late = True
    shown = exchange.look(0.002, MEASURED)
    assert shown[0] == 0.0
    assert not exchange.missing
    team.late = False
    team.answers.append((0, Telemetry(1, 0.002, 0, 0, 0, (0.002,))))  # It comes after the next question.
    shown = exchange.look(PERIOD, MEASURED)
    assert shown[0] == PERIOD
    assert exchange.step(PERIOD, MEASURED)[0][0] == 1.0
    assert not exchange.missing
    assert not exchange.stopped()


def test_a_robot_that_is_late_for_a_sample_is_missing_and_the_drives_brake(team, exchange):
    exchange.look(0.0, MEASURED)
    exchange.step(0.0, MEASURED)
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
        before = team.refusals.counts[Reason.STAMP]
        exchange._keep(0, Effort(0, stamp, 0, 0, (9.0, 9.0, 9.0), ()), admits=True)
        assert team.refusals.counts[Reason.STAMP] == before + 1
    assert exchange.step(PERIOD, MEASURED)[0][0] == 1.0


GOOD, STATUS = Effort(0, 0.0, 1, 0, (1.0, 2.0, 3.0), ()), Status(0, 0.0, True, (0,), 0, 0.0, False, (), 0)


@pytest.mark.parametrize(
    ("sender", "wrong"),
    [
        (0, msgspec.structs.replace(GOOD, efforts=(1e3,))),
        (0, msgspec.structs.replace(GOOD, rest=(1e3,) * 40)),
        (0, msgspec.structs.replace(GOOD, number=2**32 - 1)),
        (0, msgspec.structs.replace(GOOD, state=9)),
        (SUPERVISOR, msgspec.structs.replace(STATUS, team_messages=())),
        (SUPERVISOR, msgspec.structs.replace(STATUS, causes=(1, 2, 3, 4))),
    ],
)
def test_an_answer_that_is_well_formed_and_does_not_fit_changes_nothing(team, sender, wrong):
    team.answers.append((sender, wrong))
    exchange = made(team)
    assert exchange.step(0.0, MEASURED)[0].tolist() == [0.0, 0.0, 0.0]
    assert exchange.facts()["processes"][0]["state"] == "follows the plan"
    assert team.refusals.counts == {Reason.VALUE: 1}
    assert not exchange.missing
