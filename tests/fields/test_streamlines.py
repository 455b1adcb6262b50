"""Streamlines are the straight lines of the disk, pulled back."""

import numpy as np
import pytest
from shapely import Point, box

from coop_drake.fields import HarmonicMap, VelocityField, trace_streamlines
from tests.support import domains


@pytest.fixture(scope="module")
def field():
    return VelocityField(HarmonicMap(*domains.u_corridor()))


@pytest.fixture(scope="module")
def streamlines(field):
    return trace_streamlines(field, domains.inside(field.harmonic_map.region, 300, clearance=0.01))


def test_each_begins_at_its_start_and_ends_at_the_goal(field, streamlines):
    goal = np.array(field.harmonic_map.goal.coords[0])
    starts = domains.inside(field.harmonic_map.region, 300, clearance=0.01)
    np.testing.assert_array_equal([path[0] for path in streamlines.paths], starts)
    ends = np.array([path[-1] for path in streamlines.paths])
    assert streamlines.arrived.all()
    assert np.hypot(*(ends - goal).T).max() <= 0.01 * field.slowdown_radius


def test_images_run_straight_to_the_goal(field, streamlines):
    harmonic_map = field.harmonic_map
    for path in streamlines.paths:
        away = (harmonic_map(path)[0] - harmonic_map.goal_image) @ [1.0, 1.0j]
        off_line = np.abs(np.imag(np.conj(away[0]) * away)) / np.abs(away[0])
        assert off_line.max() < 0.05
        assert (np.diff(np.abs(away)) < 0.0).all()


def test_time_of_a_straight_walk_is_its_length_and_the_logarithm_of_its_end():
    field = VelocityField(HarmonicMap(box(-1, -1, 1, 1), Point(0, 0)), slowdown_radius=0.25)
    near, far = trace_streamlines(field, [[0.24, 0.0], [0.9, 0.0]]).times
    assert near == pytest.approx(0.25 * np.log(0.24 / 0.0025), rel=5e-3)
    assert far == pytest.approx((0.9 - 0.25) + 0.25 * np.log(100.0), rel=0.02)


def test_too_few_steps_leave_the_way_unfinished(field):
    lost = trace_streamlines(field, [[2.5, 2.5]], max_steps=5)
    assert not lost.arrived[0]
    assert np.isinf(lost.times[0])
    assert len(lost.paths[0]) == 6
