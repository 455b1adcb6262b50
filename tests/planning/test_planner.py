"""The planner's three answers, with the search replaced by channels written by hand."""

from dataclasses import replace

import pytest
from shapely import box

from coop_drake.answers import BeyondLimits, Found, Infeasible, SearchReport, Undecided
from coop_drake.answers.limits import Refusal
from coop_drake.laws import ScheduledGains
from coop_drake.planning import planner
from coop_drake.planning.channel import NoChannel
from tests.support.channels import bent_channel

REPORT = SearchReport(10)


@pytest.fixture
def asked(monkeypatch):
    """Play a list of answers of the search; returns the function that sets them and the questions asked."""
    questions = []

    def play(*answers):
        left = list(answers)

        def find_path(problem, progress=None):
            questions.append(problem)
            return left.pop(0), REPORT

        monkeypatch.setattr(planner, "find_path", find_path)
        return questions

    return play


def blocked(channel):
    """The same channel with an aisle of a tenth of a millimetre as its last cell."""
    last = channel.boxes[-1]
    x0, _, x1, _ = last.polygon.bounds
    wall = box(x0, 6.2, x1, 6.4).difference(box(5.0, 6.1, 5.0001, 6.5))
    return replace(channel, boxes=(*channel.boxes[:-1], replace(last, polygon=last.polygon.difference(wall))))


def ask(problem):
    return planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")


def test_a_channel_becomes_a_plan(asked):
    problem, channel = bent_channel(cells=3)
    asked(channel)
    result = ask(problem)
    assert isinstance(result, Found)
    assert result.plan.gain_set == "scheduled"
    assert result.report == REPORT


def test_a_question_that_is_changed_afterwards_is_another_question(asked):
    problem, _ = bent_channel(cells=3)
    questions = asked(NoChannel(True, "separated"), NoChannel(True, "separated"))
    ask(problem)
    problem.start[0] += 0.01
    ask(problem)
    assert questions[0] != questions[1]
    assert questions[1].start[0] == pytest.approx(questions[0].start[0] + 0.01)


def test_a_proof_is_infeasible_and_a_spent_budget_undecided(asked):
    problem, _ = bent_channel(cells=3)
    asked(NoChannel(True, "separated"))
    assert ask(problem) == Infeasible("separated", REPORT)
    asked(NoChannel(False, "budget spent"))
    assert ask(problem) == Undecided("budget spent", REPORT)


def test_a_channel_that_stalls_is_searched_again_at_half_the_margin(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(blocked(channel), channel)
    result = ask(problem)
    assert isinstance(result, Found)
    assert result.report.slices == 20
    assert [question.settings.margin for question in questions] == [0.1, channel.margin / 2]


def test_channels_that_all_stall_are_a_way_with_the_limit_named(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(*[blocked(channel)] * 3)
    result = ask(problem)
    assert isinstance(result, BeyondLimits)
    assert len(questions) == 3
    assert result.plan.refused_by[0] == Refusal(
        "planner.min_clearance", 2, pytest.approx(5e-5, rel=0.1), 1e-3, "m"
    )
    assert (
        "planner.min_clearance: in cell 2 the object's path or its target has a clearance of 0.0"
        in result.reason
    )


def test_a_stall_at_no_margin_is_not_asked_again(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(replace(blocked(channel), margin=0.0))
    assert isinstance(ask(problem), BeyondLimits)
    assert len(questions) == 1
