"""Answers that are well formed and yet do not fit the question are refused, counted, and raise nothing."""

from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest

from coop_drake.messages import SUPERVISOR, Effort, Reason, Refusals, Status, Telemetry
from coop_drake.messages.outgoing import Links
from coop_drake.nodes.sample_exchange import SampleExchange

GOOD = Effort(0, 0.0, 1, 0, (1.0, 2.0, 3.0, 4.0))
SHOWN = Telemetry(0, 0.0, 1, 0, 3, ())
STATUS = Status(0, 0.0, True, (0,), 0, 0.0, False, (), 0)


class Answers:
    """Sockets on which some answers have arrived."""

    def __init__(self, *answers):
        self.waiting, self.refusals = deque(answers), Refusals()
        self.efforts = SimpleNamespace(refusals=self.refusals)

    def send(self, index, message):
        return True

    def begin(self, sample):
        pass

    def release(self):
        return {}

    def present(self):
        return {0, SUPERVISOR}

    def receive(self, limit):
        return self.waiting.popleft() if self.waiting else None


@pytest.mark.parametrize(
    ("sender", "wrong"),
    [
        (0, GOOD._replace(efforts=(1e3,))),
        (0, GOOD._replace(efforts=(1e3,) * 40)),
        (0, GOOD._replace(number=2**32 - 1)),
        (0, GOOD._replace(state=9)),
        (SUPERVISOR, STATUS._replace(team_messages=())),
        (SUPERVISOR, STATUS._replace(causes=(1, 2, 3, 4))),
    ],
)
def test_an_answer_that_does_not_fit_changes_nothing(sender, wrong):
    end = Answers((sender, wrong), (0, GOOD), (0, SHOWN), (SUPERVISOR, STATUS))
    exchange = SampleExchange(end, 1, Links(period=0.01))
    (effort,) = exchange.step(0.0, [np.zeros(2 * 4 + 3)])
    assert effort.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert exchange.facts()["processes"][0]["state"] == "follows the plan"
    assert end.refusals.counts == {Reason.VALUE: 1}
    assert not exchange.missing
