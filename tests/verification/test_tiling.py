"""Tilings of angles: accepted when exact to the last bit, refused with the least gap or overlap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.errors import RefusalError
from coop_drake.verification.tiling import check_tiling, facet_pairs, turn_is_whole

WHOLE = np.array([-0.25 * np.pi, -1.5, 0.0]), np.array([1.75 * np.pi, 2.0, 0.4])


@st.composite
def tilings(draw):
    """A box cut again and again, anywhere, in any order."""
    boxes = [WHOLE]
    for _ in range(draw(st.integers(1, 12))):
        low, high = boxes.pop(draw(st.integers(0, len(boxes) - 1)))
        axis = draw(st.integers(0, 2))
        value = low[axis] + draw(st.floats(0.2, 0.8)) * (high[axis] - low[axis])
        upper, lower = high.copy(), low.copy()
        upper[axis] = lower[axis] = value
        boxes += [(low, upper), (lower, high)]
    lower, upper = (np.array(ends) for ends in zip(*boxes, strict=True))
    return lower, upper


@given(tilings())
@settings(max_examples=30, deadline=None)
def test_cut_boxes_tile(tiling):
    check_tiling(*tiling, WHOLE)


@given(tilings(), st.data())
@settings(max_examples=60, deadline=None)
def test_no_box_may_be_dropped_doubled_or_moved_by_a_bit(tiling, data):
    lower, upper = (ends.copy() for ends in tiling)
    k, axis = data.draw(st.integers(0, len(lower) - 1)), data.draw(st.integers(0, 2))
    change = data.draw(st.sampled_from(("drop", "double", "lower", "upper")))
    if change == "drop":
        lower, upper = np.delete(lower, k, axis=0), np.delete(upper, k, axis=0)
    elif change == "double":
        lower, upper = np.vstack((lower, lower[k])), np.vstack((upper, upper[k]))
    else:
        ends = lower if change == "lower" else upper
        ends[k, axis] = np.nextafter(ends[k, axis], data.draw(st.sampled_from((-9.0, 9.0))))
    with pytest.raises(RefusalError, match="slices"):
        check_tiling(lower, upper, WHOLE)


@given(tilings())
@settings(max_examples=40, deadline=None)
def test_facets_are_shared_where_boxes_touch_in_more_than_an_edge(tiling):
    lower, upper = tiling
    expected = set()
    for turn in (0.0, 2.0 * np.pi):
        shift = np.array([turn, 0.0, 0.0])
        for a in range(len(lower)):
            for b in range(len(lower)):
                shared = np.minimum(upper[a], upper[b] + shift) - np.maximum(lower[a], lower[b] + shift)
                if (shared > -1e-12).all() and (shared < 1e-12).sum() == 1:
                    expected.add(frozenset((a, b)))
    found = {frozenset(pair) for pair in facet_pairs(lower, upper).tolist()}
    assert {pair for pair in found if len(pair) == 2} == {pair for pair in expected if len(pair) == 2}


def test_an_axis_of_a_single_value_is_tiled_by_boxes_of_that_value():
    """As theta is at a blocked goal; a box of a single value inside a wider axis covers nothing."""
    whole = np.array([0.3, -1.0]), np.array([0.3, 1.0])
    lower, upper = np.array([[0.3, -1.0], [0.3, 0.2]]), np.array([[0.3, 0.2], [0.3, 1.0]])
    check_tiling(lower, upper, whole)
    for k, axis, value in ((0, 0, 0.2), (1, 1, 0.3), (1, 0, np.nextafter(0.3, 1.0))):
        wrong = lower.copy()
        wrong[k, axis] = value
        with pytest.raises(RefusalError, match="slices"):
            check_tiling(wrong, upper, whole)
    point = np.array([[0.3, 1.0]])
    with pytest.raises(RefusalError, match="slices"):
        check_tiling(np.vstack((lower, point, point)), np.vstack((upper, point, point)), whole)


def test_a_whole_turn_is_two_pi_up_to_rounding():
    quarter = 0.5 * np.pi
    assert turn_is_whole(-0.5 * quarter, 3.5 * quarter)
    assert not turn_is_whole(-0.5 * quarter, 3.5 * quarter - 1e-12)
    assert not turn_is_whole(0.0, np.pi)
