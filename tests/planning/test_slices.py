from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.planning.cells.slices import Slices, holds, interval_overlap, share_facet
from tests.support.cases import team_tree


def cover(splits: list[tuple[int, int]]) -> Slices:
    slices = Slices(team_tree(), 0.25)
    for pick, axis in splits:
        leaves = slices.leaves()
        slices.split(leaves[pick % len(leaves)], axis)
    return slices


SPLITS = st.lists(st.tuples(st.integers(0, 100), st.integers(0, 2)), max_size=25)


@given(SPLITS, st.floats(-10, 10), st.floats(-1.87, 1.87), st.floats(-1.87, 1.87))
def test_leaves_cover_every_angle(splits: list, theta: float, q0: float, q1: float) -> None:
    assert cover(splits).holding([theta, q0, q1])


@given(SPLITS)
def test_neighbours_are_exactly_the_leaves_that_share_a_facet(splits: list) -> None:
    slices = cover(splits)
    leaves = slices.leaves()
    for i in leaves:
        expected = {
            j for j in leaves if j != i and share_facet(slices.all[i].intervals, slices.all[j].intervals)
        }
        assert slices.all[i].neighbours == expected


@given(SPLITS)
def test_expanded_neighbours_overlap_with_interior(splits: list) -> None:
    slices = cover(splits)
    for i in slices.leaves():
        mine = slices.expanded(slices.all[i].intervals)
        assert all(-1.87 <= lower < upper <= 1.87 for lower, upper in mine[1:])
        for j in slices.all[i].neighbours:
            other = slices.expanded(slices.all[j].intervals)
            assert all(
                interval_overlap(a, b, periodic=axis == 0) > 0.0
                for axis, (a, b) in enumerate(zip(mine, other, strict=True))
            )


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
    assert holds(intervals, [0.5 - 4 * np.pi, None, 0.05])
    assert not holds(intervals, [0.5, 0.2, None])
