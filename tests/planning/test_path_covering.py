"""Paths covered with other boxes: free, overlapping, faster, and never used without a proof."""

from dataclasses import replace

import numpy as np
import pytest
from coop_drake.planning.box_crossing import cross_box, object_motion, soonest_exit
from shapely import Point

from coop_drake.answers.plan_file import check_plan
from coop_drake.laws import FixedGains, ScheduledGains, transition_gains
from coop_drake.laws.gain_schedule import schedule_of
from coop_drake.planning import make_plan, plan_time
from coop_drake.planning.cell_selection import cover_path, quickest_plan
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


def test_the_same_channel_gives_the_same_boxes(base, quick):
    again = quickest_plan(*base, ScheduledGains(), gain_set_name="scheduled")
    for first, second in zip(quick.cells, again.cells, strict=True):
        assert first.tidied.wkb == second.tidied.wkb
        np.testing.assert_array_equal(first.lower, second.lower)


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


def test_a_long_aisle_is_crossed_at_the_governors_speed():
    schedule = schedule_of(ScheduledGains())
    places, room = np.linspace(0.0, 10.0, 6), np.full(6, 0.2)
    lower, upper = np.array([-0.1]), np.array([0.1])
    state = np.zeros(5)
    motion = object_motion(state, places, room, schedule, np.inf, 0.0, np.empty((3_000, 3)))
    goals = np.array([lower, upper])
    seconds = cross_box(state, motion, lower, upper, goals, np.zeros(1), schedule, np.full(1, np.inf), 60.0)
    gains = transition_gains(
        ScheduledGains(), clearance=0.2, slice_lower=lower, slice_upper=upper,
        goal_lower=lower, goal_upper=upper, resting=np.zeros(1),
    )  # fmt: skip
    assert seconds == pytest.approx(10.0 / (speed_per_clearance(gains) * 0.2), rel=0.1)
    assert 9.8 < state[2] <= 10.0
    # The axis rests where it may leave the box: only the object takes time.
    assert soonest_exit(motion, 60.0) == seconds
    assert soonest_exit(motion, seconds - 0.1) == np.inf
    known = motion.states[: motion.known[0]].copy()
    motion = object_motion(np.zeros(5), places, room, schedule, np.inf, 0.0, np.empty((3_000, 3)))
    assert soonest_exit(motion, 60.0) == seconds
    np.testing.assert_array_equal(motion.states[: motion.known[0]], known)
