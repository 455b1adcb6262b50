"""The position's part of a budget is accepted as the planner states it, and refused if altered."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.errors import RefusalError
from coop_drake.laws.nominal import nominal_flow
from coop_drake.typed_data import DataError
from coop_drake.verification.budget import check_budget, check_position
from coop_drake.verification.runs.budget import oscillator
from tests.support.tubes import BUDGET, tubed_problem

TOLERANCE = 0.01


def plan():
    return tubed_problem()[1]


def refusal(altered):
    with pytest.raises(RefusalError) as refused:
        check_position(altered, TOLERANCE)
    return refused.value.where


def test_the_plan_is_accepted_and_says_that_the_axes_are_not_part_of_it():
    stays, rests = check_position(plan(), TOLERANCE)
    assert stays.count == len(plan().cells)
    assert stays.tightest > 0.0
    assert rests.tightest == pytest.approx(TOLERANCE - plan().tube.rest)
    assert check_budget(plan()).name == "angles and joints are not part of the budget"


@pytest.mark.parametrize("damping", [3.0, 20.0, 70.0])
def test_the_oscillator_is_the_nominal_flow(damping):
    np.testing.assert_allclose(
        oscillator(100.0, damping, 0.01), nominal_flow(100.0, damping, 0.01), rtol=1e-12
    )


LARGER = {
    "delay": 0.03, "lag": 0.015, "position_noise": 0.003, "velocity_noise": 0.05, "model_error": 0.25,
    "acceleration_error": 0.3, "control_rate": 120.0, "single_noise": 2.0, "clock_error": 2e-4,
}  # fmt: skip


@pytest.mark.parametrize("name", LARGER)
def test_a_larger_budget_is_refused(name):
    assert "tube" in refusal(replace(plan(), budget=replace(plan().budget, **{name: LARGER[name]})))


def with_transition(k, **changes):
    transitions = list(plan().transitions)
    transitions[k] = replace(transitions[k], **changes)
    return replace(plan(), transitions=tuple(transitions))


ALTERED = {
    "transitions[1].governed": lambda own: [
        {"governed": own.governed.buffer(1e-4, join_style="mitre")},
        {"governed": own.governed.buffer(0.1)},
        {"governed": None},
    ],
    "transitions[1].gains.stiffness": lambda own: [
        {"gains": replace(own.gains, stiffness=own.gains.stiffness + 1.0)}
    ],
    "transitions[1].path": lambda own: [{"neck": own.neck + 1e-3}, {"path": own.path + 1e-3}],
    "transitions[1].inradius": lambda own: [{"inradius": 2.0}],
}
"""What is altered in the second transition, by the place that is named."""


@pytest.mark.parametrize("place", ALTERED)
def test_altered_regions_and_paths_are_refused(place):
    for changes in ALTERED[place](plan().transitions[1]):
        assert refusal(with_transition(1, **changes)) == place


def test_a_target_outside_the_next_region_is_refused():
    target = np.array([3.0, 3.0])
    path = np.array([plan().start[:2], target])
    assert refusal(with_transition(0, target=target, path=path, neck=1e-3)) == "transitions[0].target"


def test_a_goal_that_is_too_narrow_and_limits_without_axes_are_refused():
    with pytest.raises(RefusalError, match=r"the goal's tolerance leaves 0\.005 m"):
        check_position(plan(), 0.005)
    for name in LIMITS:
        with pytest.raises(DataError, match="no effort is bounded without"):
            Budget(**{name: 50.0})


def test_an_object_that_may_be_faster_than_its_limit_is_refused():
    slow = 0.9 * plan().tube.velocity
    transitions = tuple(
        replace(transition, gains=replace(transition.gains, speed_limit=slow))
        for transition in plan().transitions
    )
    assert refusal(replace(plan(), transitions=transitions)) == "tube.velocity"


def test_a_tube_without_a_budget_and_a_budget_without_a_tube_are_refused():
    assert refusal(replace(plan(), tube=None)) == "tube"
    assert refusal(replace(plan(), budget=None)) == "tube"
    assert refusal(replace(plan(), budget=None, tube=None)) == "alarms"
    assert refusal(replace(plan(), budget=None, tube=None, alarms=None)) == "transitions[0].governed"
    bare = tuple(replace(transition, governed=None) for transition in plan().transitions)
    without = replace(plan(), budget=None, tube=None, alarms=None, transitions=bare)
    assert check_position(without, TOLERANCE) == []


def test_levels_must_be_there_and_leave_room_in_the_cells():
    assert refusal(replace(plan(), alarms=None)) == "alarms"
    later = replace(plan(), budget=replace(plan().budget, report_age=plan().budget.report_age + 0.005))
    assert refusal(later) == "tube.ahead"
    time = BUDGET.delay + BUDGET.report_age + BUDGET.period
    for k, transition in enumerate(plan().transitions):
        away = transition.governed.boundary.distance(plan().cells[k].tidied.boundary)
        noise = (1.0 + BUDGET.single_noise) * (BUDGET.position_noise + time * BUDGET.velocity_noise)
        assert away >= plan().tube.ahead + noise + 0.5 * BUDGET.acceleration_error * time**2
        assert away >= plan().tube.radius + (1.0 + BUDGET.single_noise) * BUDGET.position_noise
