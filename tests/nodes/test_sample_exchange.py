"""The exchange of samples paced by the wall clock, with processes whose answers the test chooses."""

from collections import deque

import numpy as np
import pytest

from coop_drake.laws.braking import Brake
from coop_drake.messages import SUPERVISOR, Effort, Present, Refusals, Sample, Status, Telemetry
from coop_drake.messages.outgoing import Links
from coop_drake.nodes.pacing import Pacing
from coop_drake.nodes.sample_exchange import SampleExchange

PERIOD = 0.005
MEASURED = [np.zeros(2 * 3 + 3)]


class Team:
    """Stands in for the world's sockets; answers at once, or later where it is told to."""

    def __init__(self):
        self.questions, self.answers, self.late = [], deque(), False
        self.refusals, self.efforts = Refusals(), self

    def begin(self, sample):
        """Nothing is lost here."""

    def release(self):
        return {}

    def present(self):
        return {0, SUPERVISOR}

    def send(self, index, question):
        if isinstance(question, Present):
            return True
        if isinstance(question, Sample):
            self.questions.append(question)
        now = [] if self.late and index == 0 else self.answers
        number, time = question.number, question.time
        if index == SUPERVISOR:
            now.append((index, Status(number, time, True, (0,), 0, 0.0, False, (), 0)))
        else:
            if question.step:
                now.append((0, Effort(number, time, 0, 0, (float(number), 0.0, 0.0))))
            now.append((0, Telemetry(number, time, 0, 0, 0, (time,))))
        return True

    def receive(self, limit):
        return self.answers.popleft() if self.answers else None


@pytest.fixture
def team():
    return Team()


@pytest.fixture
def exchange(team):
    made = SampleExchange(team, 1, Links(period=PERIOD), pacing=Pacing(allowed=0.01), tolerated=0.0)
    made.brakes = [Brake(np.ones(3), np.full(2, np.inf))]
    return made


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
    exchange.step(PERIOD, MEASURED)
    exchange.look(2 * PERIOD, MEASURED)
    assert exchange.stopped()
