from collections.abc import Collection
from dataclasses import replace
from itertools import pairwise, product
from math import inf, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.graph import Slices, holds, interval_overlap
from coop_drake.planning.channel import unwrapped
from coop_drake.tree.component_tree import ComponentTree
from tests.support.cases import team_tree


def tree_with(circles: Collection[int] = ()) -> ComponentTree:
    """The team, some of whose joints have no limits."""
    components = [
        component
        if component.joint is None or component.joint.index not in circles
        else replace(component, joint=replace(component.joint, lower=-inf, upper=inf))
        for component in team_tree().components
    ]
    return ComponentTree(tuple(components), frozenset())


def cover(splits: list[tuple[int, int]], circles: Collection[int] = ()) -> Slices:
    slices = Slices(tree_with(circles), 0.25)
    for pick, axis in splits:
        leaves = slices.leaves()
        slices.split(leaves[pick % len(leaves)], axis)
    return slices


SPLITS = st.lists(st.tuples(st.integers(0, 100), st.integers(0, 2)), max_size=25)
CIRCLES = st.sampled_from([(), (0,), (1,), (0, 1)])


def beside(one: Intervals, other: Intervals, circular: tuple[bool, ...]) -> bool:
    """Whether two boxes share a facet in one of the places that whole turns lead to."""
    for turns in product(*[(-2.0 * pi, 0.0, 2.0 * pi) if periodic else (0.0,) for periodic in circular]):
        moved = [(low + turn, high + turn) for (low, high), turn in zip(other, turns, strict=True)]
        shared = [min(a[1], b[1]) - max(a[0], b[0]) for a, b in zip(one, moved, strict=True)]
        if min(shared) > -1e-9 and sum(length < 1e-9 for length in shared) <= 1:
            return True
    return False


@given(SPLITS, CIRCLES, *[st.floats(-10, 10)] * 3)
def test_leaves_cover_every_angle(
    splits: list, circles: tuple[int, ...], theta: float, q0: float, q1: float
) -> None:
    held = [q if k in circles else 0.187 * q for k, q in enumerate((q0, q1))]
    assert cover(splits, circles).holding([theta, *held])


@given(SPLITS, CIRCLES)
def test_neighbours_are_exactly_the_leaves_that_share_a_facet(splits: list, circles: tuple[int, ...]) -> None:
    """On every circular axis the first and the last slice meet, of whatever widths they are."""
    slices = cover(splits, circles)
    leaves = slices.leaves()
    for i in leaves:
        expected = {
            j
            for j in leaves
            if j != i and beside(slices.all[i].intervals, slices.all[j].intervals, slices.circular)
        }
        assert slices.all[i].neighbours == expected


@given(SPLITS, CIRCLES)
def test_expanded_neighbours_overlap_with_interior(splits: list, circles: tuple[int, ...]) -> None:
    slices = cover(splits, circles)
    for i in slices.leaves():
        mine = slices.expanded(slices.all[i].intervals)
        inside = [-1.87 <= lower < upper <= 1.87 for lower, upper in mine[1:]]
        assert all(held or k in circles for k, held in enumerate(inside))
        for j in slices.all[i].neighbours:
            other = slices.expanded(slices.all[j].intervals)
            assert all(
                interval_overlap(a, b, periodic) > 0.0
                for a, b, periodic in zip(mine, other, slices.circular, strict=True)
            )


@given(SPLITS, CIRCLES, st.lists(st.integers(0, 200), min_size=1, max_size=12))
def test_boxes_of_a_way_through_neighbours_lie_beside_each_other(
    splits: list, circles: tuple[int, ...], picks: list[int]
) -> None:
    """Each box of a channel overlaps the next one where whole turns have moved it, however far it winds."""
    slices = cover(splits, circles)
    way = [slices.leaves()[0]]
    for pick in picks:
        beyond = sorted(slices.all[way[-1]].neighbours)
        way.append(beyond[pick % len(beyond)])
    boxes = [slices.expanded(slices.all[leaf].intervals) for leaf in way]
    start = [
        0.5 * (low + high) + 6.0 * pi * on for (low, high), on in zip(boxes[0], slices.circular, strict=True)
    ]
    moved = unwrapped(boxes, start, slices.circular)
    assert all(low < value < high for value, (low, high) in zip(start, moved[0], strict=True))
    for one, other in pairwise(moved):
        assert all(min(a[1], b[1]) > max(a[0], b[0]) for a, b in zip(one, other, strict=True))
    for before, after in zip(boxes, moved, strict=True):
        turns = [(b[0] - a[0]) / (2.0 * pi) for a, b in zip(before, after, strict=True)]
        assert np.allclose(turns, np.where(slices.circular, np.round(turns), 0.0))


def test_a_joint_without_limits_is_cut_at_pi_and_its_halves_meet_there() -> None:
    slices = Slices(tree_with((1,)), 0.25)
    assert slices.axis_widths == (2.0 * pi, 3.74, 2.0 * pi)
    low, high = slices.split(0, 2)
    thin = slices.split(low, 2)[0]
    assert slices.all[thin].intervals[2] == (-pi, -0.5 * pi)
    assert high in slices.all[thin].neighbours
    assert slices.expanded(slices.all[thin].intervals)[2][0] < -pi
    assert slices.holding([0.0, 0.0, 3.0 * pi]) == slices.holding([0.0, 0.0, -pi])


def test_the_first_and_the_last_slice_of_theta_meet() -> None:
    slices = Slices(team_tree(), 0.25)
    assert slices.all[0].neighbours == {1, 3}
    assert slices.all[3].neighbours == {0, 2}
    assert slices.holding([-0.25 * pi, 0.0, 0.0]) == [0, 3]
    assert slices.holding([pi, 0.0, None]) == slices.holding([-pi, 0.0, None])


def test_overlap_is_a_share_of_the_width() -> None:
    slices = Slices(team_tree(), 0.25)
    (lower, upper), *_ = slices.expanded(slices.all[1].intervals)
    assert upper - lower == pytest.approx(1.25 * 0.5 * pi)


def test_holding_ignores_free_joints() -> None:
    intervals = ((0.0, 1.0), (0.0, 0.1), (0.0, 0.1))
    assert holds(intervals, [0.5 - 4 * np.pi, None, 0.05], (True, False, False))
    assert not holds(intervals, [0.5, 0.2, None], (True, False, False))
