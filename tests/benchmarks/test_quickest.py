"""The judge of motions: its pace and its search on questions whose quickest time is known otherwise."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from scipy.linalg import block_diag
from shapely import box

from benchmarks.planner.family import corridor_problem
from benchmarks.quickest import (
    CLEARANCE,
    control_points,
    improve,
    largest_share,
    quickest,
    shares_of,
    spline,
    team_of,
    timed,
)
from coop_drake.answers import Found
from coop_drake.answers.problem import TeamLimits
from coop_drake.laws import ScheduledGains
from coop_drake.planning.motion_limits import base_places
from coop_drake.planning.planner import plan
from coop_drake.verification.runs.bodies import least_distances

LIMITS = TeamLimits(
    base_components=(1, 2),
    base_points=((0.35, 0.0), (0.35, 0.0)),
    joint_rates=np.ones(2),
    joint_accelerations=np.full(2, 2.0),
)
"""The bases of the two robots are where the family of questions has them; usual limits count, 1 m/s^2."""


def straight_ahead(length):
    """Two robots carry a bar straight ahead on an empty floor, and hold it at the end as at the start."""
    start, goal = np.array([2.0, 2.0, 0.0, 0.0, 0.0]), np.array([2.0 + length, 2.0, 0.0])
    return replace(
        corridor_problem(), workspace=box(0.0, 0.0, length + 4.0, 4.0), start=start, goal_pose=goal,
        goal_joints=(0.0, 0.0), limits=LIMITS, passes=True,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("length", "seconds"), [(5.0, 5.0 + 1.0), (0.6, 2.0 * sqrt(0.6))])
def test_the_quickest_motion_of_bases_straight_ahead_is_found(length, seconds):
    """Each base has to move by the length: at 1 m/s^2 up to 1 m/s, or to the middle, and down again."""
    problem = straight_ahead(length)
    answer = plan(problem, ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(answer, Found)
    found = quickest(problem, answer.plan, trials=100)
    assert len(found.ways) >= 3
    assert seconds * (1.0 - 1e-9) <= found.seconds <= 1.01 * seconds
    assert answer.plan.motion.duration > found.seconds


@pytest.mark.slow
def test_a_way_that_begins_in_a_wall_is_mended_and_keeps_the_clearance():
    problem = replace(straight_ahead(5.0), goal_joints=(None, None))
    block = box(4.0, 0.0, 5.0, 1.9)
    problem = replace(problem, workspace=problem.workspace.difference(block).buffer(0.0))
    team = team_of(problem, problem.start[None])
    points = control_points(np.array([problem.start, [7.0, 2.0, 0.0, 0.0, 0.0]]), team.scale)[0]
    shares = shares_of(5 * len(points), len(points)), shares_of(600, len(points))
    assert improve(team, *shares, points, 0, np.random.default_rng(0))[1] > 0.0
    seconds, lack = improve(team, *shares, points, 20_000, np.random.default_rng(0))
    assert (lack, seconds > 6.0) == (0.0, True)
    narrow = replace(problem, workspace=problem.workspace.buffer(-CLEARANCE, quad_segs=32))
    assert least_distances(narrow, spline(points)(np.linspace(0.0, 1.0, 2_000))).min() > 0.0


def wild_way(team):
    """Control points of a way that turns and swings its arms."""
    random = np.random.default_rng(3)
    return np.cumsum(random.normal(0.1, 0.15, (40, 5)), axis=0) / team.scale


@pytest.mark.slow
def test_limits_are_used_up_and_kept_better_with_more_stages(monkeypatch):
    problem, excess = straight_ahead(5.0), []
    team = team_of(problem, problem.start[None])
    for stages in (20, 80):
        monkeypatch.setattr("benchmarks.quickest.FINE", stages)
        seconds, rows = timed(team, wild_way(team))
        share = largest_share(problem, rows, seconds)
        assert largest_share(problem, rows, 0.5 * seconds) == pytest.approx(2.0 * share)
        excess.append(share - 1.0)
    assert 0.0 <= 4.0 * excess[1] < excess[0] < 0.01


@pytest.mark.slow
def test_a_way_takes_as_long_as_toppra_says():
    """Toppra has polygons with 64 sides inside of the limits, with which a way takes up to 0.06 % longer."""
    from toppra import SplineInterpolator, algorithm, constraint

    problem = straight_ahead(5.0)
    team = team_of(problem, problem.start[None])
    points = wild_way(team)
    seconds = timed(team, points)[0]
    s, circle = np.linspace(0.0, 1.0, 1_000), 2.0 * pi * np.arange(64) / 64
    z = spline(points)(s)
    bases = base_places(team.chains, z)
    places = [z[:, :2], *bases[..., :2], *bases[..., 2:], z[:, 3:4], z[:, 4:]]
    normals = np.stack([np.cos(circle), np.sin(circle)], axis=1)
    sides = [normals / np.cos(pi / 64) if place.shape[1] == 2 else [[1.0], [-1.0]] for place in places]
    F = block_diag(*(np.asarray(side) / most for side, most in zip(sides, team.limits[:, 1], strict=True)))
    lengths = [
        np.cumsum(np.linalg.norm(np.diff(place, axis=0, prepend=place[:1]), axis=1)) for place in places
    ]
    path = SplineInterpolator(s, np.column_stack([*places, *lengths]))
    F = np.hstack([F, np.zeros((len(F), len(places)))])  # Accelerations are limited by the places,
    fast = np.append(
        np.full(F.shape[1] - len(places), 1e3), np.minimum(team.limits[:, 0], 1e3)
    )  # speeds by lengths.
    limits = [
        constraint.JointVelocityConstraint(np.stack([-fast, fast], axis=1)),
        constraint.SecondOrderConstraint(
            lambda q, v, a: a, lambda q: F, lambda q: np.ones(len(F)), len(fast)
        ),
    ]
    speed = algorithm.TOPPRA(limits, path, gridpoints=s).compute_parameterization(0.0, 0.0)[1]
    assert (2.0 * np.diff(s) / (speed[1:] + speed[:-1])).sum() == pytest.approx(seconds, rel=3e-3)
