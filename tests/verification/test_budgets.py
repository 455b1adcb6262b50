"""What a plan with a motion states about its budget, and each alteration of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.errors import RefusalError
from coop_drake.verification.budget import check_departures
from coop_drake.verification.motion import check_motion
from tests.support.motions import planned_under_budget


@pytest.fixture(scope="module")
def base():
    """The plan of ``base`` under the budget of its preset, its question, and its gain set."""
    return planned_under_budget("base")


def refusal(plan, problem, gains):
    try:
        check_motion(plan, problem, gains)
        check_departures(plan, problem)
    except RefusalError as error:
        return str(error)
    raise AssertionError("nothing was refused")


def test_a_plan_holds_under_the_budget_that_it_states(base):
    plan, problem, gains = base
    assert plan.budget.clock_error == 0.002
    assert plan.motion.waiting == pytest.approx(2.0 * (0.05 + 2.0 * 0.002 + 2.0 * 0.005))
    check_motion(plan, problem, gains)
    checks = check_departures(plan, problem)
    limited = [check.name for check in checks if "beyond its limit under the budget" in check.name]
    assert [name.split(" is ")[0] for name in limited] == [
        "no base force",
        "no base torque",
        "no joint effort",
    ]
    assert 0.0 < float(plan.departures.room[0]) < 0.05


def with_region(plan, region):
    other = replace(plan.transitions[3], governed=region)
    return replace(plan, transitions=(*plan.transitions[:3], other, *plan.transitions[4:]))


def with_budget(plan, **changes):
    return replace(plan, budget=replace(plan.budget, **changes))


def with_motion(plan, **changes):
    return replace(plan, motion=replace(plan.motion, **changes))


def other_body(plan):
    (_, *body), *others = plan.budget.bodies
    return ((99, *body), *others)


ALTERED = {
    "no departures": (lambda p: replace(p, departures=None), "departures: is missing"),
    "no budget": (lambda p: replace(p, budget=None), "motion.gains"),
    "a region as wide as its cell": (
        lambda p: with_region(p, p.cells[3].tidied), "transitions[3].governed: comes"
    ),
    "a region beyond its cell": (
        lambda p: with_region(p, p.cells[3].tidied.buffer(0.01)), "transitions[3].governed: leaves"
    ),
    "no region": (lambda p: with_region(p, None), "transitions[3].governed: is missing"),
    "waits less": (lambda p: with_motion(p, waiting=0.12), "motion.waiting"),
    "words are older": (lambda p: with_budget(p, report_age=0.06), "motion.waiting"),
    "other gains": (lambda p: with_motion(p, gains=((200.0, 20.0), p.motion.gains[1])), "departures."),
    "an unstable loop": (
        lambda p: with_motion(p, gains=((1e5, 10.0), p.motion.gains[1])), "motion.gains: the team does not"
    ),
    "more noise": (lambda p: with_budget(p, velocity_noise=0.05), "departures."),
    "too many numbers": (
        lambda p: replace(p, departures=replace(p.departures, alarm=np.zeros(9))), "departures.alarm: has 9"
    ),
    "weaker bases": (lambda p: with_budget(p, base_force=50.0), "departures.effort["),
    "bodies of another team": (lambda p: with_budget(p, bodies=other_body(p)), "budget.bodies"),
}  # fmt: skip


@pytest.mark.parametrize("name", ALTERED)
def test_altered_plans_are_refused_by_the_entry(base, name):
    (alter, begins), (plan, problem, gains) = ALTERED[name], base
    found = refusal(alter(plan), problem, gains)
    assert found.startswith(begins), found


def test_a_goal_nearer_than_the_team_rests_is_refused(base):
    plan, problem, gains = base
    narrow = replace(problem, position_tolerance=1e-3)
    assert refusal(plan, narrow, gains).startswith("departures.rest[0]")


def test_where_the_motion_ends_and_how_far_the_team_rests_from_it_share_the_tolerance_of_the_goal(base):
    plan, problem, gains = base
    rest, off = float(plan.departures.rest[0]), 1e-3
    moved = replace(plan, goal_pose=plan.goal_pose + np.array([off, 0.0, 0.0]))
    said = refusal(moved, replace(problem, position_tolerance=0.99 * (off + rest)), gains)
    assert said.startswith(f"departures.rest[0]: is {rest:.6g}, and the motion ends 0.001 from the goal")
    enough = replace(problem, position_tolerance=1.01 * (off + rest))
    check_motion(moved, enough, gains)
    check_departures(moved, enough)
