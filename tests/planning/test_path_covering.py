"""Paths covered with other boxes: free, overlapping, faster, and never used without a proof."""

from dataclasses import replace
from itertools import combinations, pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from shapely import Point

from coop_drake.answers.plan_file import check_plan
from coop_drake.laws import FixedGains, ScheduledGains, transition_gains
from coop_drake.laws.gains import schedule_of
from coop_drake.planning import cell_selection, make_plan, plan_time
from coop_drake.planning.cell_selection import Waypoints, cover_path, quickest_plan
from coop_drake.planning.cells.cells import CellMaker
from coop_drake.planning.duration import speed_per_clearance
from coop_drake.planning.search import find_channel
from coop_drake.planning.transitions import path_through, turned_to_start
from tests.support.cases import case
from tests.support.free_positions import FreePositions


@pytest.fixture(scope="module")
def base():
    problem = case("base")
    channel, _ = find_channel(problem)
    return problem, turned_to_start(problem, channel)


@pytest.fixture(scope="module")
def quick(base):
    return quickest_plan(*base, ScheduledGains(), gain_set_name="scheduled")


def test_every_configuration_of_the_new_boxes_is_free(base, quick):
    problem, _ = base
    rng = np.random.default_rng(3)
    for cell in quick.cells:
        low, high = np.array(cell.tidied.bounds).reshape(2, 2)
        for corner in rng.integers(0, 2, (6, len(cell.lower))):
            angles = np.where(corner == 1, cell.upper, cell.lower)
            inside = rng.uniform(low, high, (60, 2))
            inside = inside[[cell.tidied.buffer(-1e-6).contains(Point(point)) for point in inside]]
            assert FreePositions(problem.tree, problem.workspace, angles).free(inside).all()


def test_the_plan_is_executable_and_quicker_than_the_channels_own_boxes(base, quick):
    check_plan(quick, "quick")
    own = make_plan(*base, ScheduledGains(), gain_set_name="scheduled")
    assert plan_time(quick) < plan_time(own)
    assert len(quick.cells) < len(own.cells)


def test_fixed_gains_get_boxes_of_their_own(base):
    fixed = quickest_plan(*base, FixedGains(), gain_set_name="paper")
    own = make_plan(*base, FixedGains(), gain_set_name="paper")
    assert plan_time(fixed) < plan_time(own)


def test_targets_lie_in_the_cores_of_both_boxes_and_cores_inside(base):
    problem, channel = base
    found = cover_path(problem, channel.path, channel.margin, ScheduledGains())
    assert found is not None
    assert 0.0 < found.channel.margin < channel.margin
    for index, (here, after) in enumerate(zip(found.channel.boxes, found.channel.boxes[1:], strict=False)):
        assert here.core.contains(Point(found.targets[index]))
        assert after.core.contains(Point(found.targets[index]))
        assert here.polygon.covers(here.core)
        assert here.polygon.boundary.distance(here.core) >= found.channel.margin - 1e-7
        assert (np.maximum(here.lower, after.lower) < np.minimum(here.upper, after.upper)).all()


def test_a_path_can_be_made_from_the_boxes_alone(base):
    problem, channel = base
    path = path_through(problem, channel)
    np.testing.assert_array_equal(path[0], problem.start)
    np.testing.assert_allclose(path[-1, :3], [*problem.goal_pose[:2], channel.goal_angle])
    plan = quickest_plan(problem, replace(channel, path=None), ScheduledGains(), gain_set_name="scheduled")
    check_plan(plan, "plan")
    for z in path:
        assert FreePositions(problem.tree, problem.workspace, z[2:]).free(z[None, :2]).all()


def test_what_cannot_be_proved_is_not_used(base, monkeypatch):
    own = make_plan(*base, ScheduledGains(), gain_set_name="scheduled")
    monkeypatch.setattr(CellMaker, "under_cells", lambda self, expanded: [])
    assert cover_path(base[0], base[1].path, base[1].margin, ScheduledGains()) is None
    plan = quickest_plan(*base, ScheduledGains(), gain_set_name="scheduled")
    assert [cell.tidied.wkb for cell in plan.cells] == [cell.tidied.wkb for cell in own.cells]


@pytest.mark.parametrize("limit", [np.inf, 0.3])
def test_a_long_aisle_takes_the_time_of_the_governors_speed_or_of_the_limit(limit):
    schedule, places = schedule_of(ScheduledGains()), np.linspace(0.0, 10.0, 6)
    asked = SimpleNamespace(schedule=schedule, places=places, limits=np.array([limit]))
    lower, upper = np.array([-0.1]), np.array([0.1])
    gains = transition_gains(
        ScheduledGains(), clearance=0.2, slice_lower=lower, slice_upper=upper,
        goal_lower=lower, goal_upper=upper, resting=np.zeros(1),
    )  # fmt: skip
    speed = min(speed_per_clearance(gains) * 0.2, limit)
    assert cell_selection._travel.py_func(asked, 0, 5, np.full(6, 0.2)) == pytest.approx(10.0 / speed)


def test_the_boxes_chosen_are_the_quickest_of_all_sequences(monkeypatch):
    """Every sequence of boxes along seven waypoints of two angles, whose boxes are free as a table says."""
    random = np.random.default_rng(5)
    path = np.column_stack([np.arange(7.0), np.zeros(7), random.normal(0.0, 0.3, (7, 2)).cumsum(axis=0)])
    pads, free = np.array([0.02, 0.1]), random.random((7, 7)) < 0.7
    clearances_of = lambda boxes, grid, lower, upper, path, i, j, most: (  # noqa: E731
        np.full(j - i + 1, 0.5 / (j - i)) if free[i, j] or j == i + 1 else np.empty(0)
    )
    monkeypatch.setattr(cell_selection, "clearances_in_box", clearances_of)
    travel, closing = cell_selection._travel.py_func, cell_selection._closing.py_func
    monkeypatch.setattr(cell_selection, "_travel", travel)
    monkeypatch.setattr(cell_selection, "_closing", closing)
    waypoints = Waypoints(
        SimpleNamespace(lower=np.full(2, -9.0), upper=np.full(2, 9.0)), None, path, path[:, 0], pads,
        np.array([path[-1, 2:] - 0.1, path[-1, 2:] + 0.1]), schedule_of(ScheduledGains()), np.full(3, np.inf),
        0.01,
    )  # fmt: skip

    def seconds(ends, widths):
        total = 0.0
        for k, (i, j) in enumerate(pairwise(ends)):
            clearances = clearances_of(None, None, None, None, path, i, j, 1.0)
            if len(clearances) == 0:
                return np.inf
            held, pad = path[i : j + 1, 2:], pads[widths[k]]
            lower, upper = held.min(axis=0) - pad, held.max(axis=0) + pad
            around = (
                waypoints.goals if j == 6 else path[j, 2:] + pads[widths[k + 1]] * np.array([[-1.0], [1.0]])
            )
            goals = np.array([np.maximum(lower, around[0]), np.minimum(upper, around[1])])
            times = travel(waypoints, i, j, clearances), closing(waypoints, i, lower, upper, goals)
            total += max(times) + cell_selection.BOX_COST / pad
        return total

    between = [c for size in range(6) for c in combinations(range(1, 6), size)]
    sequences = [([0, *c, 6], w) for c in between for w in product(range(2), repeat=len(c) + 1)]
    rows = cell_selection.choose_boxes.py_func(waypoints)
    chosen = seconds([0, *rows[:, 1].tolist()], rows[:, 2].tolist())
    assert chosen == pytest.approx(min(seconds(*sequence) for sequence in sequences))
