"""From a channel to a plan: targets, intervals, other boxes, times; and what is refused."""

from dataclasses import replace
from itertools import combinations, pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, box

from coop_drake.answers import Found
from coop_drake.answers.plan import check_plan
from coop_drake.errors import PlanError, StallError
from coop_drake.geometry import BoundaryDistance
from coop_drake.laws import FixedGains, ScheduledGains, transition_gains
from coop_drake.laws.gains import schedule_of
from coop_drake.planning import Channel, FreeBox, cell_selection, make_plan, plan_time, planner, reschedule
from coop_drake.planning.cell_selection import Waypoints, cover_path, quickest_plan
from coop_drake.planning.cells.cells import CellMaker
from coop_drake.planning.duration import speed_per_clearance, timed, transition_time, travel_time
from coop_drake.planning.limits import fill
from coop_drake.planning.search import find_channel
from coop_drake.planning.transitions import path_through, turned_to_start
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario, with_gains
from paper.governor_run import run_governor
from tests.support.cases import case
from tests.support.free_positions import FreePositions
from tests.support.small_plan import small_plan

# From a channel to a plan: targets, goal intervals, regions, gains; and what is refused.


def corridor(widths=(1.0, 1.0, 1.0), *, turn=0.4, goal_joints=(None, None)):
    """A problem and a channel along x: one rectangle of the given half-width per box, the angle rising."""
    problem = case("base")
    boxes = []
    for k, half in enumerate(widths):
        polygon = box(2.0 * k, -half, 2.0 * k + 3.0, half)
        lower = np.array([turn * k - 0.4, -0.3, -0.3 + 0.1 * k])
        boxes.append(FreeBox(polygon, lower, lower + np.array([0.8, 0.6, 0.6])))
    goal_angle = turn * (len(widths) - 1)
    problem = replace(
        problem,
        start=np.array([0.5, 0.0, 0.0, 0.0, 0.0]),
        goal_pose=np.array([2.0 * len(widths), 0.0, goal_angle]),
        goal_joints=goal_joints,
    )
    return problem, Channel(tuple(boxes), goal_angle, margin=0.1)


def plan_of(problem, channel, gain_set=None):
    return make_plan(problem, channel, gain_set or ScheduledGains(), gain_set_name="scheduled")


def test_the_last_goal_is_strictly_within_the_tolerances():
    problem, channel = corridor(goal_joints=(0.1, None))
    last = plan_of(problem, channel).transitions[-1]
    goal = channel.goal_angle
    assert goal - problem.angle_tolerance < last.goal_lower[0] < goal < last.goal_upper[0]
    assert last.goal_upper[0] < goal + problem.angle_tolerance
    assert 0.1 - problem.joint_tolerance < last.goal_lower[1] < 0.1 < last.goal_upper[1]
    assert (last.goal_lower[2], last.goal_upper[2]) == (
        channel.boxes[-1].lower[2],
        channel.boxes[-1].upper[2],
    )
    np.testing.assert_array_equal(last.target, problem.goal_pose[:2])
    assert last.inradius <= problem.position_tolerance
    assert last.inradius == pytest.approx(problem.position_tolerance, rel=0.01)


def test_a_goal_at_the_edge_of_its_slice_keeps_the_interval_inside():
    problem, channel = corridor()
    edge = channel.boxes[-1].upper[0]
    last = plan_of(problem, replace(channel, goal_angle=edge)).transitions[-1]
    assert edge - problem.angle_tolerance < last.goal_lower[0] < last.goal_upper[0] == edge


@given(st.lists(st.floats(0.05, 2.0), min_size=2, max_size=5))
@settings(max_examples=20)
def test_any_corridor_becomes_a_sound_plan(widths):
    plan = plan_of(*corridor(tuple(widths), turn=0.2))
    check_plan(plan, "plan")
    for cell in plan.cells:
        assert cell.tidied.is_valid
        assert not cell.tidied.interiors


def test_reschedule_changes_gains_alone():
    problem, channel = corridor()
    plan = plan_of(problem, channel)
    paper = reschedule(plan, FixedGains(), "paper")
    assert paper.gain_set == "paper"
    assert {transition.gains.stiffness for transition in paper.transitions} == {50.0}
    assert paper.cells is plan.cells
    again = reschedule(paper, ScheduledGains(), "scheduled")
    for first, second in zip(plan.transitions, again.transitions, strict=True):
        np.testing.assert_array_equal(first.gains.energy_bound, second.gains.energy_bound)
        assert first.estimated_time == second.estimated_time
        assert first.gains.stiffness == second.gains.stiffness


def test_a_passage_of_half_a_millimetre_is_refused_by_name():
    problem, channel = corridor()
    aisle = box(0, -1, 1.4, 1).union(box(1.3, 0, 1.8, 0.0005)).union(box(1.7, -1, 3, 1))
    boxes = (replace(channel.boxes[0], polygon=aisle), *channel.boxes[1:])
    with pytest.raises(
        StallError, match=r"cell 0 is refused by planner\.min_clearance: .*\(1\.\d+, 0\.000\) is 0\.5 mm wide"
    ):
        plan_of(problem, replace(channel, boxes=boxes))
    patient = replace(problem.settings, min_clearance=2e-4, max_transition_time=1e4)
    made = plan_of(replace(problem, settings=patient), replace(channel, boxes=boxes))
    assert made.transitions[0].neck < 3e-4


def test_a_transition_of_minutes_is_refused():
    problem, channel = corridor(widths=(0.02, 0.02))
    hasty = replace(problem, settings=replace(problem.settings, max_transition_time=10.0))
    with pytest.raises(StallError, match=r"planner\.max_transition_time: .* and at most 10 s"):
        plan_of(hasty, channel)


def test_positions_that_do_not_overlap_are_refused():
    problem, channel = corridor()
    far = replace(channel.boxes[1], polygon=box(20, 0, 21, 1))
    with pytest.raises(PlanError, match="cells 0 and 1: their positions do not overlap"):
        plan_of(problem, replace(channel, boxes=(channel.boxes[0], far, channel.boxes[2])))


def test_slices_that_do_not_overlap_are_refused():
    problem, channel = corridor()
    shift = np.array([0.0, 5.0, 0.0])
    after = replace(
        channel.boxes[1], lower=channel.boxes[1].lower + shift, upper=channel.boxes[1].upper + shift
    )
    with pytest.raises(PlanError, match="cell 0: on axis 1 it shares no interval"):
        plan_of(problem, replace(channel, boxes=(channel.boxes[0], after, channel.boxes[2])))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": np.array([-1.0, 0.0, 0.0, 0.0, 0.0])}, "start's position"),
        ({"start": np.array([0.5, 0.0, 0.0, 0.9, 0.0])}, "start's angles"),
        ({"goal_pose": np.array([0.0, 9.0, 0.8])}, "goal's position"),
    ],
)
def test_ends_outside_the_channel_are_refused(change, message):
    problem, channel = corridor()
    with pytest.raises(PlanError, match=message):
        plan_of(replace(problem, **change), channel)


# Paths covered with other boxes: free, overlapping, faster, and never used without a proof.


@pytest.fixture(scope="module")
def base_channel():
    problem = case("base")
    channel, _ = find_channel(problem)
    return problem, turned_to_start(problem, channel)


@pytest.fixture(scope="module")
def quick(base_channel):
    return quickest_plan(*base_channel, ScheduledGains(), gain_set_name="scheduled")


def test_the_plan_is_executable_and_quicker_than_the_channels_own_boxes(base_channel, quick):
    check_plan(quick, "quick")
    own = make_plan(*base_channel, ScheduledGains(), gain_set_name="scheduled")
    assert plan_time(quick) < plan_time(own)


def test_fixed_gains_get_boxes_of_their_own(base_channel):
    fixed = quickest_plan(*base_channel, FixedGains(), gain_set_name="paper")
    own = make_plan(*base_channel, FixedGains(), gain_set_name="paper")
    assert plan_time(fixed) < plan_time(own)


def test_targets_keep_the_margin_in_both_boxes(base_channel):
    problem, channel = base_channel
    covered, targets = cover_path(problem, channel.path, channel.margin, ScheduledGains())
    assert 0.0 < covered.margin < channel.margin
    for index, (here, after) in enumerate(zip(covered.boxes, covered.boxes[1:], strict=False)):
        for polygon in (here.polygon, after.polygon):
            assert polygon.contains(Point(targets[index]))
            assert polygon.boundary.distance(Point(targets[index])) >= covered.margin - 1e-6
        assert (np.maximum(here.lower, after.lower) < np.minimum(here.upper, after.upper)).all()


def test_a_path_can_be_made_from_the_boxes_alone(base_channel):
    problem, channel = base_channel
    path = path_through(problem, channel)
    np.testing.assert_array_equal(path[0], problem.start)
    np.testing.assert_allclose(path[-1, :3], [*problem.goal_pose[:2], channel.goal_angle])
    plan = quickest_plan(problem, replace(channel, path=None), ScheduledGains(), gain_set_name="scheduled")
    check_plan(plan, "plan")
    for z in path:
        assert FreePositions(problem.tree, problem.workspace, z[2:]).free(z[None, :2]).all()


def test_what_cannot_be_proved_is_not_used(base_channel, monkeypatch):
    own = make_plan(*base_channel, ScheduledGains(), gain_set_name="scheduled")
    monkeypatch.setattr(CellMaker, "under_cells", lambda self, expanded: [])
    assert cover_path(base_channel[0], base_channel[1].path, base_channel[1].margin, ScheduledGains()) is None
    plan = quickest_plan(*base_channel, ScheduledGains(), gain_set_name="scheduled")
    assert [cell.tidied.wkb for cell in plan.cells] == [cell.tidied.wkb for cell in own.cells]


@pytest.mark.parametrize("limit", [np.inf, 0.3])
def test_a_long_aisle_takes_the_time_of_the_governors_speed_or_of_the_limit(limit):
    schedule, places = schedule_of(ScheduledGains()), np.linspace(0.0, 10.0, 6)
    asked = SimpleNamespace(schedule=schedule, places=places, limits=np.array([limit]), passing=False)
    lower, upper = np.array([-0.1]), np.array([0.1])
    gains = transition_gains(
        ScheduledGains(), clearance=0.2, slice_lower=lower, slice_upper=upper,
        goal_lower=lower, goal_upper=upper, resting=np.zeros(1),
    )  # fmt: skip
    speed = min(speed_per_clearance(gains) * 0.2, limit)
    assert cell_selection._travel.py_func(asked, 0, 5, np.full(6, 0.2)) == pytest.approx(10.0 / speed)


def test_a_box_is_passed_at_the_pace_from_which_the_team_can_stop_in_it():
    """At the pace v, hearing of all takes the way w v, and the stop v^2 / 2, at unit limits."""
    heard, pad = cell_selection.HEARD_AFTER, 0.03
    pace = 0.2 / cell_selection._passing_time.py_func(0.2, pad)
    assert heard * pace + 0.5 * pace**2 == pytest.approx(0.2 + 2.0 * pad)
    assert cell_selection._passing_time.py_func(4.0, pad) == pytest.approx(4.0)


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
        0.01, False, np.zeros(2),
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


# Estimated times against the rule and against a transport carried out.


def test_a_transition_takes_settling_and_travel():
    assert transition_time(3.0, 0.1) == pytest.approx(10.6)
    assert travel_time(0.0, 0.1) == 0.0


@pytest.mark.parametrize("gain_set", [FixedGains(), ScheduledGains()])
def test_speed_in_a_long_aisle_is_that_of_a_governed_point(gain_set):
    half_width = 0.15
    aisle = box(0.0, -half_width, 30.0, half_width)
    lower, upper = np.array([-1.0]), np.array([1.0])
    gains = transition_gains(
        gain_set, clearance=half_width, slice_lower=lower, slice_upper=upper,
        goal_lower=lower, goal_upper=upper, resting=np.zeros(1),
    )  # fmt: skip
    run = run_governor(
        BoundaryDistance(aisle), lambda point: np.array([1.0, 0.0]), position=np.array([2.0, 0.0]),
        velocity=np.zeros(2), governor=np.array([2.0, 0.0]), seconds=8.0, tolerance=1e-8,
        gains=(gains.stiffness, gains.damping, gains.governor_gain, 0.0),
    )  # fmt: skip
    assert run.velocity[-1, 0] == pytest.approx(speed_per_clearance(gains) * half_width, rel=1e-3)


def test_a_transition_that_is_never_left_gets_the_rule_and_two_minutes():
    plan = small_plan(("arm",))
    gains = replace(plan.transitions[0].gains, energy_bound=np.full(2, 1e-12))
    shut = replace(
        plan, transitions=(plan.transitions[0], *(replace(t, gains=gains) for t in plan.transitions[1:]))
    )
    first = timed(shut).transitions[0]
    rule = transition_time(first.length, first.neck, speed_per_clearance(first.gains))
    assert first.estimated_time == 120.0 + rule


# Limits of bases are shared so that they are kept, and by no more than they are.


@settings(max_examples=100)
@given(st.integers(1, 4), st.integers(1, 6), st.integers(0, 10_000))
def test_shares_keep_all_bounds_and_none_could_grow(rows, count, seed):
    generator = np.random.default_rng(seed)
    levers = generator.uniform(0.2, 2.0, (rows, count)) * (generator.random((rows, count)) < 0.7)
    bounds = np.where(generator.random(rows) < 0.8, generator.uniform(0.1, 3.0, rows), np.inf)
    caps = np.where(generator.random(count) < 0.5, generator.uniform(0.1, 3.0, count), np.inf)
    shares = fill(levers, bounds, caps, generator.uniform(0.1, 2.0, count))
    finite = np.isfinite(bounds)
    free = ~((levers[finite] > 0.0).any(axis=0) | np.isfinite(caps))
    assert (np.isinf(shares) == free).all()
    known = np.where(free, 0.0, shares)
    used = levers[finite] @ known
    assert (used <= bounds[finite] * (1.0 + 1e-9)).all()
    assert (known[~free] <= caps[~free]).all()
    full = used >= bounds[finite] * (1.0 - 1e-6)
    held = (levers[finite][full] > 0.0).any(axis=0) | (known >= caps * (1.0 - 1e-6))
    assert held[~free].all()


def test_shares_are_in_proportion_to_needs_until_one_is_held():
    levers, caps = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]), np.array([np.inf, 0.5, np.inf])
    shares = fill(levers, np.array([2.0, 6.0]), caps, np.array([1.0, 1.0, 2.0]))
    assert shares == pytest.approx([1.5, 0.5, 4.5])


@pytest.mark.slow
def test_limits_of_speed_are_numbers_where_the_estimated_transport_has_no_bound():
    """Table 2 is for another team: in ``three`` its gains ask for rates beyond all numbers."""
    scenario = with_gains(load_scenario("three"), "table_2")
    answer = planner.plan(planning_problem(scenario), scenario.gain_sets["table_2"], gain_set_name="table_2")
    assert isinstance(answer, Found)
    for transition in answer.plan.transitions:
        assert not np.isnan(transition.gains.rate_limit).any()
