from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, box, union_all

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.channel import Channel, NoChannel
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, TreeJoint
from coop_drake.tree.pose import PlanarPose
from tests.support.cases import case, rectangle, transport
from tests.support.short_search import sample_little
from tests.support.soundness import assert_channel_is_sound


def rod_problem(corridor: float, settings: PlannerSettings | None = None) -> PlanningProblem:
    """A rod of 1.0 x 0.2 that must pass a corridor along x and may turn in both rooms."""
    tree = ComponentTree(
        (Component("rod", None, None, (Body("rod", None, (rectangle(-0.5, 0.5, -0.1, 0.1),)),)),), frozenset()
    )
    half = 0.5 * corridor
    floor = union_all([box(-4, -1, -1, 1), box(-1.1, -half, 1.1, half), box(1, -1, 4, 1)])
    assert isinstance(floor, Polygon)
    return PlanningProblem(
        floor,
        tree,
        np.array([-2.5, 0.0, 1.5]),
        np.array([2.5, 0.0, 1.5]),
        (),
        settings=settings if settings is not None else PlannerSettings(),
    )


@pytest.mark.parametrize("name", ["base", "tight", "three", "elbow"])
def test_feasible_cases_are_found_and_sound(name: str) -> None:
    problem = case(name)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.margin > 0.0
    assert_channel_is_sound(problem, channel)


def test_a_joint_that_moves_no_solid_body_is_planned_too() -> None:
    problem = rod_problem(1.0)
    joint = TreeJoint("rod::idle", "revolute", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -1.0, 1.0)
    bare = Component("bare", 0, joint, ())  # The plant leaves bodies without geometry out of components.
    tree = ComponentTree((*problem.tree.components, bare), frozenset())
    start = np.append(problem.start, 0.8)
    idle = replace(problem, tree=tree, start=start, goal_joints=(-0.8,))
    channel, _ = find_channel(idle)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(idle, channel)
    assert channel.boxes[-1].lower[1] <= -0.8 <= channel.boxes[-1].upper[1]


def test_closed_is_proved() -> None:
    channel, _ = find_channel(case("closed"))
    assert isinstance(channel, NoChannel)
    assert channel.proved


@pytest.mark.parametrize(("corridor", "found"), [(0.23, True), (0.19, False)])
def test_a_rod_passes_a_corridor_wider_than_itself_only(corridor: float, found: bool) -> None:
    problem = rod_problem(corridor)
    channel, _ = find_channel(problem)
    if found:
        assert isinstance(channel, Channel)
        assert_channel_is_sound(problem, channel)
    else:
        assert isinstance(channel, NoChannel)
        assert channel.proved


def test_a_spent_budget_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    sample_little(monkeypatch)
    problem = rod_problem(0.2002, PlannerSettings(max_slices=8))
    channel, _ = find_channel(problem)
    assert isinstance(channel, NoChannel)
    assert not channel.proved
    assert 0.0 < channel.mixed[0].width_fraction <= 1.0


def test_a_start_near_a_wall_does_not_forbid_a_margin() -> None:
    problem = case("base")
    start = problem.start.copy()
    start[0] = 0.28
    near = replace(problem, start=start)
    channel, _ = find_channel(near)
    assert isinstance(channel, Channel)
    assert channel.margin > 0.0
    assert_channel_is_sound(near, channel)


@pytest.mark.parametrize(
    ("pose", "joints"),
    [
        ((5.0, 6.6, 0.0), (None, None)),  # the object is in the door's wall
        ((6.2, 4.5, 0.0), (None, None)),  # a hand fits, the base behind it does not, whatever its joint
        ((5.0, 8.0, 1.57), (0.0, 2.9)),  # a joint beyond its limit puts a base into the other's hand
    ],
)
def test_a_goal_in_collision_is_refuted_at_once(
    pose: tuple[float, float, float], joints: tuple[float | None, float | None]
) -> None:
    channel, report = find_channel(replace(case("base"), goal_pose=np.array(pose), goal_joints=joints))
    assert isinstance(channel, NoChannel)
    assert channel.proved
    assert "at the goal" in channel.reason
    assert report.slices <= 128


def test_joints_with_a_goal_reach_it() -> None:
    problem = replace(case("base"), goal_joints=(-1.0, 0.6))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)


def test_progress_is_told_and_may_interrupt() -> None:
    told: list[str] = []

    def stop(phase: str, count: float) -> None:
        told.append(phase)
        assert count >= 0.0
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_channel(case("base"), stop)
    assert told == ["sampling paths"]


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_millimetre_of_room_is_found() -> None:
    """The corridor is three millimetres wider than one in which the object alone is proved to be stuck."""
    problem = transport(0.78)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)
