"""Samples of the boundary: where they are, and that they go where they belong."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Point, box

from coop_drake.fields import HarmonicMap
from coop_drake.fields.boundary import sample_boundary
from tests.support import domains

ROOM = box(0, 0, 6, 4).difference(box(2, 1, 3, 3))


@pytest.mark.parametrize(
    "goal", [Point(5, 2), box(5, 1, 6, 3), box(4, 1.5, 5, 2.5)], ids=["point", "arc", "hole"]
)
def test_the_residual_stays_below_the_estimate(goal):
    mapped = HarmonicMap(ROOM, goal, tolerance=1e-7)
    samples = sample_boundary(mapped, 33)
    # The mean of a hole's samples may be off by as much as a sample.
    assert samples.residual.max() <= 2.0 * mapped.accuracy.error_estimate
    assert samples.residual.shape == samples.arc_length.shape == samples.ring.shape


def test_samples_lie_on_the_walls_and_arc_length_runs_through_all_rings():
    mapped = HarmonicMap(ROOM, Point(5, 2), tolerance=1e-7)
    samples = sample_boundary(mapped, 33)
    assert shapely.distance(ROOM.boundary, shapely.points(samples.points)).max() < 1e-12
    assert (np.diff(samples.arc_length) > 0.0).all()
    assert samples.arc_length[-1] == pytest.approx(ROOM.length, abs=0.01)
    assert list(np.unique(samples.ring)) == [0, 1]
    np.testing.assert_allclose(np.diff(samples.vertex_arc_length)[:3], [6.0, 4.0, 6.0])


def test_walls_go_round_the_circle_in_proportion_to_their_length():
    mapped = HarmonicMap(*domains.u_corridor(), tolerance=1e-7)
    samples = sample_boundary(mapped)
    turns = np.unwrap(np.arctan2(*samples.expected.T[::-1])) / (2.0 * np.pi)
    along = (samples.arc_length - samples.arc_length[0]) / mapped.region.length
    np.testing.assert_allclose(turns - turns[0], along)
    np.testing.assert_allclose(samples.vertex_images, mapped(samples.vertices)[0], atol=1e-6)
