"""A plan with a budget is accepted as the planner states it, and refused with any statement altered."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import load_plan
from coop_drake.errors import RefusalError
from coop_drake.laws.axis_table import axis_table, bounds_of, track_row
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from coop_drake.verification import budget as checks
from coop_drake.verification.budget import check_budget, check_room
from coop_drake.verification.runs.budget import commanded
from tests.support.cli import invoke
from tests.support.scenarios import TWO_ROOMS, write_scenario

BUDGET = """
control_rate: 200
delay: 0.005
lag: 0.002
angle_noise: 0.0004
rate_noise: 0.008
model_error: 0.06
acceleration_error: 0.05
report_age: 0.01
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("budget")
    write_scenario(folder / "room.scenario.yaml", **TWO_ROOMS)
    (folder / "budget.yaml").write_text(BUDGET)
    result = invoke(
        "plan", folder / "room.scenario.yaml", "--budget", folder / "budget.yaml", "--out", folder
    )
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture(scope="module")
def plan(folder):
    return load_plan(folder / "plan.json")


def test_the_plan_is_accepted(folder, plan):
    assert plan.budget is not None
    assert len(plan.transitions) > 1
    assert check_budget(plan).count == len(plan.transitions) * (1 + len(plan.joint_names))
    result = invoke("verify", folder / "plan.json", folder / "room.scenario.yaml", "--json")
    assert result.exit_code == 0, result.output
    assert "axes stay in their funnels under the budget" in result.stdout


def test_the_law_is_written_twice_and_is_the_same(plan):
    """Logs are checked with a form of the law of their own."""
    generator = np.random.default_rng(2)
    for k, transition in enumerate(plan.transitions):
        table = axis_table(plan.funnel(k), transition.gains)
        for time in (0.0, 0.2, 0.9, 3.0):
            lower, upper = np.array([bounds_of(row, time)[:2] for row in table]).T
            for share in generator.uniform(-0.05, 1.05, (20, len(table))):
                x, v = lower + share * (upper - lower), generator.uniform(-1.0, 1.0, len(table))
                due = [track_row(row, time, x[i], v[i])[0] for i, row in enumerate(table)]
                assert commanded(plan, k, time, x, v) == pytest.approx(np.array(due), rel=1e-9, abs=1e-9)


DEPARTURES = {
    "delay": 0.03, "lag": 0.02, "angle_noise": 0.004, "rate_noise": 0.05, "model_error": 0.4,
    "acceleration_error": 1.0, "axis_error": 1.0, "control_rate": 60.0,
}  # fmt: skip


@pytest.mark.parametrize("name", DEPARTURES)
def test_a_larger_budget_is_refused(plan, name):
    altered = replace(plan, budget=replace(plan.budget, **{name: DEPARTURES[name]}))
    with pytest.raises(RefusalError) as refusal:
        check_budget(altered)
    assert "tolerance" in refusal.value.where or refusal.value.where == "axis_tracking"


def test_a_plan_for_right_clocks_is_refused_for_wrong_ones(plan):
    """Whatever it states about how fast axes are: departures, levels and reserves are too small."""
    wrong, axes = replace(plan.budget, clock_error=2e-4), plan.start.size - 2
    with pytest.raises(RefusalError, match=r"axis_tracking\.rate: has 0 numbers, not"):
        check_budget(replace(plan, budget=wrong))
    for fast, where in ((1e-6, "axis_tracking.rate"), (5.0, "tolerance"), (100.0, "tolerance")):
        tracking = replace(plan.axis_tracking, rate=(fast,) * axes, acceleration=(10.0 * fast,) * axes)
        with pytest.raises(RefusalError) as refusal:
            check_budget(replace(plan, budget=wrong, axis_tracking=tracking))
        assert where in refusal.value.where


def test_old_reports_leave_monitors_more_to_see(plan):
    with pytest.raises(RefusalError) as refusal:
        check_budget(replace(plan, budget=replace(plan.budget, report_age=0.2)))
    assert refusal.value.where.startswith("transitions[0].tolerance.ahead_alarm[0]")


def altered(plan, k=0, **changes):
    return with_transition(plan, k, tolerance=replace(plan.transitions[k].tolerance, **changes))


def test_levels_that_are_missing_or_too_few_are_refused(plan):
    times, alarm = (getattr(plan.transitions[0].tolerance, name) for name in ("alarm_times", "alarm"))
    for other, where in (
        (replace(plan, alarms=None), "alarms"),
        (altered(plan, alarm=(np.ones(1), *alarm[1:])), "transitions[0].tolerance.alarm"),
        (altered(plan, ahead_alarm=alarm[:-1]), "transitions[0].tolerance.ahead_alarm"),
        (altered(plan, rate_alarm=np.ones(1)), "transitions[0].tolerance.rate_alarm"),
        (altered(plan, alarm_times=times + 0.1), "transitions[0].tolerance.alarm_times"),
        (altered(plan, alarm_times=times[::-1]), "transitions[0].tolerance.alarm_times"),
        (altered(plan, alarm_times=np.empty(0)), "transitions[0].tolerance.alarm_times"),
    ):
        with pytest.raises(RefusalError) as refusal:
            check_budget(other)
        assert refusal.value.where == where


@pytest.mark.parametrize("name", ["alarm", "ahead_alarm"])
def test_levels_with_which_a_monitor_misses_what_leaves_the_funnel_are_refused(plan, name):
    """All that the plan says of the transition else is true, and nothing within the budget is an alarm."""
    k = len(plan.transitions) - 1
    levels = [one + np.array([0.0, 0.5, 0.0]) for one in getattr(plan.transitions[k].tolerance, name)]
    with pytest.raises(RefusalError, match="its monitor may miss") as refusal:
        check_budget(altered(plan, k, **{name: tuple(levels)}))
    assert refusal.value.where == f"transitions[{k}].tolerance.{name}[0][1]"


def test_levels_of_a_stage_that_begins_early_are_below_what_departs_before_it(plan):
    """Where an axis still accelerates, it departs by more than the levels of the last stage allow."""
    k, times = next(
        (k, one.tolerance.alarm_times)
        for k, one in enumerate(plan.transitions)
        if one.tolerance.alarm_times.size > 1
    )
    early = times.copy()
    early[-1] = 0.5 * (times[-2] + times[-1])
    with pytest.raises(RefusalError) as refusal:
        check_budget(altered(plan, k, alarm_times=early))
    assert refusal.value.where.startswith(f"transitions[{k}].tolerance.")


def test_what_the_monitor_of_a_cell_may_miss_needs_room_in_the_next_cell_too():
    check_room(np.full(3, 0.1), np.full(3, 0.1), "here", "its monitor")
    with pytest.raises(RefusalError, match="a monitor in the cell before may miss") as refusal:
        check_room(np.full(3, 0.1), np.array([0.1, 0.0999, 0.1]), "here", "a monitor in the cell before")
    assert refusal.value.where == "here[1]"


def with_transition(plan, k, **changes):
    transitions = list(plan.transitions)
    transitions[k] = replace(transitions[k], **changes)
    return replace(plan, transitions=tuple(transitions))


@pytest.mark.parametrize(
    ("name", "factor", "where"),
    [
        ("rate", 3.0, r"transitions\[1\].tolerance.entry"),
        ("reach", 0.01, r"transitions\[0\].tolerance"),
        ("rate", 0.01, r"transitions\[0\].tolerance"),
    ],
)
def test_another_condition_of_rest_is_refused(plan, name, factor, where):
    """A looser one lets axes enter the next cell from more states; a stricter one may never be met."""
    gains = plan.transitions[0].gains
    rest = replace(gains.rest, **{name: factor * getattr(gains.rest, name)})
    with pytest.raises(RefusalError, match=where):
        check_budget(with_transition(plan, 0, gains=replace(gains, rest=rest)))


def test_a_plan_without_a_condition_of_rest_is_refused(plan):
    altered = with_transition(plan, 0, gains=replace(plan.transitions[0].gains, rest=None))
    with pytest.raises(RefusalError, match=r"transitions\[0\].gains.rest"):
        check_budget(altered)


def test_a_budget_without_sets_and_sets_without_a_budget_are_refused(plan):
    with pytest.raises(RefusalError, match="has no budget"):
        check_budget(replace(plan, budget=None))
    for altered in (with_transition(plan, 0, tolerance=None), replace(plan, axis_tracking=None)):
        with pytest.raises(RefusalError, match="is missing"):
            check_budget(altered)
    position = replace(plan, budget=replace(plan.budget, axes=False))
    with pytest.raises(RefusalError, match="no budget for the axes"):
        check_budget(position)


def test_bad_budgets_are_bad_input(folder, tmp_path):
    for name, text, key in (
        ("budget.yaml", "{dealy: 1}", "dealy"),
        ("budget.yaml", "{bodies: [[0, 1, 0, 0, 1]]}", "component, mass, x, y, inertia, robot"),
        ("budget.yaml", "{bodies: [[0, 1, 0, 0, 1, 0]]}", "the team's"),
        ("budget.yaml", "{base_force: 50}", "null without axes, bodies and the base of every robot"),
        ("none.yaml", "", "none.yaml"),
    ):
        (tmp_path / "budget.yaml").write_text(text)
        result = invoke("plan", folder / "room.scenario.yaml", "--budget", tmp_path / name)
        assert (result.exit_code, key in result.output) == (2, True)


def test_a_plan_with_bodies_is_checked_with_its_team_and_those_of_others_are_refused(folder, plan):
    tree = planning_problem(load_scenario(folder / "room.scenario.yaml")).tree
    strange = replace(plan, budget=replace(plan.budget, bodies=((9, 1.0, 0.0, 0.0, 0.1, 0.0),)))
    with pytest.raises(ValueError, match="tree: expected the team"):
        check_budget(strange)
    for other, where in (
        (strange, "budget.bodies"),
        (replace(plan, budget=replace(plan.budget, rotors=(0.0,))), "budget.rotors"),
    ):
        with pytest.raises(RefusalError) as refusal:
            check_budget(other, tree)
        assert refusal.value.where == where


def test_what_a_cell_misses_is_held_against_the_room_of_the_next_one(plan, monkeypatch):
    """Room at entry that is none refuses the cell that comes after one in which something may be missed."""
    check_budget(plan)
    monkeypatch.setattr(checks, "room_at_entry", lambda seen, budget: np.zeros(seen.room.shape[1]))
    with pytest.raises(RefusalError, match="a monitor in the cell before may miss") as refusal:
        check_budget(plan)
    assert refusal.value.where.startswith("transitions[1].tolerance.alarm_times")


@pytest.mark.parametrize("since", [0, 1])
def test_what_is_missed_stays_unknown_in_a_cell_that_can_be_left_at_once(plan, monkeypatch, since):
    """Cell 0 misses a radian, cell 1 nothing; cell 2 has room for half of it."""
    axes, cells = len(plan.start) - 2, len(plan.transitions)
    assert cells > 2
    missed = iter([1.0] + [0.0] * (cells - 1))
    room = iter([2.0, 2.0] + [0.5] * (cells - 2))
    left = iter([1, since] + [1] * (cells - 2))
    monkeypatch.setattr(checks, "_check_axis_alarms", lambda *asked: np.full(axes, next(missed)))
    monkeypatch.setattr(checks, "room_at_entry", lambda *asked: np.full(axes, next(room)))
    monkeypatch.setattr(checks, "leaving_since", lambda *asked: next(left))
    if since:
        check_budget(plan)
        return
    with pytest.raises(RefusalError, match="a monitor in the cell before may miss") as refusal:
        check_budget(plan)
    assert refusal.value.where.startswith("transitions[2].tolerance.alarm_times")
