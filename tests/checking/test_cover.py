"""Cells, forbidden positions and squeezes must cover the plane: what they do not cover may be free."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.checking import RefusedError, plane
from coop_drake.checking.infeasible import _check_cover, _chosen
from coop_drake.checking.plane import ONE
from coop_drake.checking.regions import FULL, Region


@pytest.fixture(autouse=True)
def _steps(monkeypatch):
    monkeypatch.setattr(plane, "work_left", [10**7])


def rectangle(x0, y0, x1, y1):
    return [(round(x * ONE), round(y * ONE)) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]


def outside(*box):
    return Region([rectangle(*box)], odd=False)


def test_the_edges_of_a_squeeze_that_covers_a_cell_are_covered_themselves():
    cells, squeezes = [Region([rectangle(2, 2, 3, 3)])], [Region([rectangle(0, 0, 9, 9)])]
    with pytest.raises(RefusedError, match="no cell covers"):
        _check_cover(cells, squeezes, [], outside(-20, -20, 20, 20), "slices[0]")


@pytest.mark.parametrize(("half", "covered"), [(0.5, True), (0.1, False)])
def test_walls_forbid_positions_by_each_of_two_witnesses(half, covered):
    # Mean corners are on the floor for x from 1.7 to 5.7 and from -2 to 2: both are between 1.7 and 2, where
    # only the second witness, if it is wide enough, meets the wall at x = 4.
    witnesses = [rectangle(-1.8, -0.1, -1.6, 0.1), rectangle(2 - half, -half, 2 + half, half)]
    floor = outside(0, -10, 4, 10)
    if covered:
        assert _check_cover([], [], witnesses, floor, "slices[0]") > 0
    else:
        with pytest.raises(RefusedError, match="no cell covers"):
            _check_cover([], [], witnesses, floor, "slices[0]")


PLACE = st.integers(-1, 9).map(lambda k: k * FULL // 8)


@given(st.lists(st.tuples(PLACE, PLACE, st.integers(0, 5)), max_size=8))
def test_stretches_are_chosen_that_reach_furthest(stretches):
    expected, covered = set(), -1
    while covered < FULL:
        high, k = max([(high, -k) for low, high, k in stretches if low <= max(covered, 0)], default=(-1, 0))
        if high <= covered:
            expected = set()
            break
        expected, covered = expected | {-k}, high
    assert _chosen(stretches) == expected
