"""From a channel to a plan: targets, goal intervals, regions, gains; and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, box

from coop_drake.answers.plan_file import check_plan
from coop_drake.errors import PlanError, StallError
from coop_drake.geometry import BoundaryDistance, PassageFinder
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.planning import Channel, FreeBox, make_plan, reschedule
from tests.support.cases import case
from tests.support.channels import bent_channel
from tests.support.point_mass import carry_out, straight_fields


def corridor(widths=(1.0, 1.0, 1.0), *, turn=0.4, goal_joints=(None, None)):
    """A problem and a channel along x: one rectangle of the given half-width per box, the angle rising."""
    problem = case("base")
    boxes = []
    for k, half in enumerate(widths):
        polygon = box(2.0 * k, -half, 2.0 * k + 3.0, half)
        lower = np.array([turn * k - 0.4, -0.3, -0.3 + 0.1 * k])
        boxes.append(FreeBox(polygon, polygon.buffer(-0.1 * half), lower, lower + np.array([0.8, 0.6, 0.6])))
    goal_angle = turn * (len(widths) - 1)
    problem = replace(
        problem,
        start=np.array([0.5, 0.0, 0.0, 0.0, 0.0]),
        goal_pose=np.array([2.0 * len(widths), 0.0, goal_angle]),
        goal_joints=goal_joints,
    )
    return problem, Channel(tuple(boxes), 0.1, goal_angle)


def plan_of(problem, channel, gain_set=None):
    return make_plan(problem, channel, gain_set or ScheduledGains(), gain_set_name="scheduled")


@pytest.fixture(scope="module")
def bent_plan():
    return plan_of(*bent_channel())


def test_neighbours_share_targets_with_room_around_them(bent_plan):
    for k, transition in enumerate(bent_plan.transitions[:-1]):
        here, after = bent_plan.cells[k : k + 2]
        room = min(BoundaryDistance(cell.tidied)(transition.target) for cell in (here, after))
        assert transition.inradius == pytest.approx(room)
        assert transition.inradius > 0.05
        assert LineString(transition.path).length == transition.length
        np.testing.assert_array_equal(transition.path[-1], transition.target)


def test_goal_intervals_are_what_neighbouring_slices_share(bent_plan):
    for transition, here, after in zip(
        bent_plan.transitions, bent_plan.cells, bent_plan.cells[1:], strict=False
    ):
        np.testing.assert_array_equal(transition.goal_lower, np.maximum(here.lower, after.lower))
        np.testing.assert_array_equal(transition.goal_upper, np.minimum(here.upper, after.upper))


def test_necks_and_lengths_are_those_of_passages_in_the_tidied_cells(bent_plan):
    entry = bent_plan.start[:2]
    for cell, transition in zip(bent_plan.cells, bent_plan.transitions, strict=True):
        passage = PassageFinder(cell.tidied).find(entry, transition.target)
        assert (transition.neck, transition.length) == (passage.clearance, passage.length)
        assert transition.only_angles == (transition.length < 1e-9)
        entry = transition.target


def test_a_made_plan_passes_the_checks_and_reaches_its_goal():
    plan = plan_of(*corridor())
    check_plan(plan, "plan")
    transport = carry_out(plan, straight_fields(plan))
    assert transport.stuck is None
    assert transport.least_energy_margin >= 0.0
    assert transport.least_cell_clearance > 0.0
    assert transport.least_funnel_gap > 0.0
    assert np.hypot(*(transport.position - plan.goal_pose[:2])) <= 0.01
    assert abs(transport.axes[0] - plan.goal_pose[2]) <= 0.02


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_angles_are_shifted_by_full_turns_to_the_start(turns):
    problem, channel = corridor()
    shift = np.array([2 * np.pi * turns, 0.0, 0.0])
    turned = replace(
        channel,
        boxes=tuple(replace(b, lower=b.lower + shift, upper=b.upper + shift) for b in channel.boxes),
        goal_angle=channel.goal_angle + shift[0],
    )
    plan, expected = plan_of(problem, turned), plan_of(problem, channel)
    np.testing.assert_allclose(plan.goal_pose, expected.goal_pose, atol=1e-12)
    np.testing.assert_allclose(plan.cells[1].lower, expected.cells[1].lower, atol=1e-12)


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


def test_cores_that_do_not_overlap_are_refused():
    problem, channel = corridor()
    far = replace(channel.boxes[1], core=box(20, 0, 21, 1))
    with pytest.raises(PlanError, match="cells 0 and 1: their cores do not overlap"):
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
