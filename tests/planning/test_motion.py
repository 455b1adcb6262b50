"""The quickest motion through cells: inside them, within limits, smooth, and stoppable at every moment."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.interpolate import BSpline
from shapely.ops import substring

from coop_drake.answers import Found, PlanningResult, Undecided
from coop_drake.answers.plan import Cell
from coop_drake.laws import ScheduledGains
from coop_drake.planning import motion as program
from coop_drake.planning import planner
from coop_drake.planning.duration import plan_time, timed
from coop_drake.planning.motion import MOST_SPANS, cell_sets, first_points, first_ways, quickest_motion
from coop_drake.planning.motion_limits import (
    base_chains,
    base_places,
    motion_limits,
    slow_limits,
    team_chains,
    times_at_limits,
)
from coop_drake.planning.transitions import share_speeds
from coop_drake.plant import planning_problem
from coop_drake.tree.arrays import FloatArray
from tests.support.motions import planned_motion, small_motion


class Case:
    """A shipped scenario with its plan, limits as people have them, and the motion."""

    def __init__(self, name: str) -> None:
        self.plan, self.problem = planned_motion(name)
        of = self.problem.limits
        self.bases = list(zip(of.base_components, of.base_points, strict=True))
        self.limits = motion_limits(of)
        assert self.plan.motion is not None
        self.motion = self.plan.motion
        # scipy's splines are another implementation than the one that is tested.
        knots = self.motion.period * (np.arange(len(self.motion.points) + 4) - 3.0)
        self.spline = BSpline(knots, self.motion.points, 3)

    def used(self, seconds: FloatArray, way: FloatArray) -> tuple[float, float]:
        """Return the largest shares of the limits of speed and acceleration by differences."""
        parts, step, shares = self._parts(way), seconds[1] - seconds[0], []
        for order in range(2):
            of = [np.linalg.norm(np.diff(part, order + 1, axis=0), axis=1) for part in parts]
            shares.append(self._share(of, order) / step ** (order + 1))
        return shares[0], shares[1]

    def used_of_jerk(self) -> float:
        """Return the largest share of the limits of jerk in the mean over a span, by differences."""
        period, step = self.motion.period, 1e-4
        times = np.arange(1, len(self.motion.points) - 3) * period
        before, at, after = (self._parts(self.spline(times + shift)) for shift in (-step, 0.0, step))
        of = [
            np.linalg.norm(np.diff(a - 2.0 * b + c, axis=0), axis=1)
            for a, b, c in zip(before, at, after, strict=True)
        ]
        return self._share(of, 2) / (step * step * period)

    def _parts(self, way: FloatArray) -> list[FloatArray]:
        """Return the places of the object and of the bases, then the bases' angles and all joints."""
        bases = base_places(base_chains(self.problem.tree, self.bases), way)
        places = np.concatenate([way[None, :, :2], bases[..., :2]])
        return [*places, *np.concatenate([bases[..., 2], way[:, 3:].T])[..., None]]

    def _share(self, of: list[FloatArray], order: int) -> float:
        return max(float(x.max()) / y for x, y in zip(of, self.limits[: len(of), order], strict=True))


@pytest.fixture(scope="module", params=["base", "elbow"])
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param)


def test_cells_are_left_one_after_the_other_where_several_hold_the_end() -> None:
    scenario, plan = small_motion()
    assert plan.motion is not None
    last, near = plan.cells[-1], shapely.Point(plan.goal_pose[:2]).buffer(0.2)
    smaller = Cell(last.lower, last.upper, shapely.intersection(last.tidied, near))
    cells, transitions = (*plan.cells, smaller), (*plan.transitions, plan.transitions[-1])
    longer, problem = replace(plan, cells=cells, transitions=transitions), planning_problem(scenario)
    motion = quickest_motion(longer, problem, motion_limits(problem.limits), plan.motion.gains)
    assert len(motion.windows) == len(cells)
    assert (np.diff(motion.windows, axis=0) > 0.0).all()
    assert motion.windows[-1, 1] == pytest.approx(motion.duration)


def test_cells_are_entered_one_after_the_other_where_two_hold_the_start() -> None:
    scenario, plan = small_motion()
    assert plan.motion is not None
    first, way = plan.transitions[0], shapely.LineString(plan.transitions[0].path)
    parts = [substring(way, *ends, normalized=True) for ends in ((0.0, 0.1), (0.1, 1.0))]
    halves = [replace(first, path=shapely.get_coordinates(part)) for part in parts]
    cells, transitions = (plan.cells[0], *plan.cells), (*halves, *plan.transitions[1:])
    twice = replace(plan, cells=cells, transitions=transitions)
    problem = planning_problem(scenario)
    motion = quickest_motion(twice, problem, motion_limits(problem.limits), plan.motion.gains)
    assert motion.windows[0, 0] == 0.0
    assert (np.diff(motion.windows, axis=0) > 0.0).all()


def test_the_initial_path_along_a_very_long_way_has_few_points() -> None:
    scenario, plan = small_motion()
    problem = planning_problem(scenario)
    cells, chains, limits = cell_sets(plan, None), team_chains(problem), motion_limits(problem.limits)
    points = first_points(first_ways(plan), cells, chains, 1e-3 * limits, 2.0)
    assert len(points) < 3 * MOST_SPANS  # 8687 without a bound
    seconds = times_at_limits(chains, 1e-3 * limits, points[:, :-1]).sum()
    assert seconds <= points[-2, -1] <= 2.0 * seconds


def test_a_team_that_is_hardly_slower_than_usual_keeps_its_larger_limits() -> None:
    scenario, _ = small_motion()
    problem = planning_problem(scenario)
    chains, usual = team_chains(problem), motion_limits(problem.limits.usual(len(problem.tree.joints)))
    slow = np.zeros(len(usual), bool)
    slow[5:7] = True  # the joints
    ways = [np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 3.0, 0.0]])]
    limits = np.where(slow[:, None], usual / np.power(1.1, [1.0, 2.0, 3.0]), 5.0 * usual)
    unit, scaled = slow_limits(chains, limits, usual, ways)
    assert unit == pytest.approx(1.1)
    np.testing.assert_allclose(scaled, limits * np.power(unit, [1.0, 2.0, 3.0]))
    still = [np.zeros((2, 5))]
    assert slow_limits(chains, limits, usual, still)[0] == 1.0


def test_cells_that_are_too_narrow_for_the_usual_room_leave_less(monkeypatch) -> None:
    _, problem = planned_motion("base")
    monkeypatch.setattr(program, "ROOM", 10.0)
    monkeypatch.setattr(program, "ROOM_SHARE", 0.6)
    assert isinstance(planner.plan(problem, ScheduledGains(), gain_set_name="scheduled"), Found)


def test_slow_teams_take_as_much_longer_as_they_are_slower() -> None:
    scenario, plan = small_motion()
    problem, gains = planning_problem(scenario), ((25.0, 10.0), (25.0, 10.0))
    limits = motion_limits(problem.limits)
    usual = quickest_motion(plan, problem, limits, gains).duration
    for slower in (10.0, 1e5):
        limit = limits / np.power(slower, [1.0, 2.0, 3.0])
        longer = quickest_motion(plan, problem, limit, gains).duration
        # A slow team waits for words for a smaller share of its time, and is a little less slow by that.
        assert 0.5 * slower * usual <= longer <= slower * usual


@pytest.mark.parametrize(
    ("key", "limit"),
    [
        ("base_speed", {"base_speeds": np.full(2, 1e-4)}),
        ("base_turn_rate", {"turn_rates": np.full(2, 1e-5)}),
        ("base_acceleration", {"base_accelerations": np.full(2, 1e-5)}),
        ("friction", {"frictions": np.full(2, 1e-6)}),
    ],
)
def test_a_limit_that_is_too_low_is_refused_by_its_key_with_a_value_that_is_quick_enough(key, limit) -> None:
    _, problem = planned_motion("base")
    ((name, stated),) = limit.items()

    def ask(**changes: FloatArray) -> PlanningResult:
        asked = replace(problem, limits=replace(problem.limits, **changes))
        return planner.plan(asked, ScheduledGains(), gain_set_name="scheduled")

    refused = ask(**limit)
    assert isinstance(refused, Undecided)
    found = re.fullmatch(rf"limits\.\*\.{key} is (\S+) .* expected (\S+) .* or more", refused.reason)
    assert found is not None
    assert float(found[1]) == stated[0]
    least = float(found[2])
    assert isinstance(ask(**{name: np.full(2, least)}), Found)
    assert isinstance(ask(**{name: np.full(2, 0.5 * least)}), Undecided)


def test_all_limits_are_kept_and_used(case: Case) -> None:
    seconds = np.linspace(0.0, case.motion.duration, 20001)
    for share in (*case.used(seconds, case.spline(seconds)), case.used_of_jerk()):
        assert 0.9 < share <= 1.0


def test_it_is_quicker_than_cells_that_end_at_rest(case: Case) -> None:
    at_rest = share_speeds(case.problem, timed(case.plan), ScheduledGains())
    assert case.motion.duration < 0.6 * plan_time(at_rest)
