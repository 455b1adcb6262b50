import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.errors import UnmappableError
from coop_drake.fields.goals import region_to_map
from coop_drake.fields.outline import outline_of
from tests.support import domains

ROOM = box(0, 0, 4, 2)


def outline(domain, goal, inside=None):
    return outline_of(*region_to_map(domain, goal, inside))


def test_angles_are_linear_in_arc_length():
    o = outline(ROOM, Point(1, 1))
    length = np.abs(o.ends - o.vertices)
    np.testing.assert_allclose(o.angle_end - o.angle_start, 2 * np.pi * length / 12.0)
    np.testing.assert_allclose(o.corner_angles, np.pi / 2)
    assert o.goal_ring is None
    assert o.goal_angle is None


def test_domain_lies_left_of_every_ring():
    ring_with_hole = ROOM.difference(box(1, 0.5, 2, 1.5))
    o = outline(ring_with_hole, Point(3, 1))
    areas = [0.5 * np.sum(np.imag(np.conj(o.vertices) * o.ends)[o.ring == k]) for k in range(o.holes + 1)]
    np.testing.assert_allclose(areas, [8.0, -1.0])
    np.testing.assert_allclose(o.corner_angles[o.ring == 1], 1.5 * np.pi)


def test_repeated_and_collinear_vertices_are_dropped():
    noisy = Polygon([(0, 0), (1, 0), (1 + 1e-13, 0), (2, 0), (4, 0), (4, 2), (0, 2), (0, 1)])
    assert len(outline(noisy, Point(1, 1)).vertices) == 4


def test_goal_on_the_outer_ring_gets_no_angle():
    o = outline(ROOM, box(3, 0, 4, 2))
    span = o.angle_end - o.angle_start
    arc = np.isclose(o.vertices.real + o.centre.real, 3) & np.isclose(o.ends.real + o.centre.real, 3)
    assert arc.sum() == 1
    assert span[arc] == 0.0
    assert span.sum() == pytest.approx(2 * np.pi)
    assert o.goal_angle == o.angle_start[arc]


def test_ends_of_a_collinear_goal_arc_stay_vertices():
    # The goal hangs on the wall by a strip as thin as nothing: its arc lies along the wall's line.
    bay = ROOM.union(box(1, 2, 2, 3))
    o = outline(bay, box(1, 2, 2, 3))
    assert len(o.vertices) == 6


def test_interior_goal_is_a_hole():
    o = outline(ROOM.difference(box(0.2, 0.2, 0.6, 0.6)), box(2, 0.5, 3, 1.5))
    assert o.holes == 2
    assert o.goal_ring is not None
    hole = o.vertices[o.ring == o.goal_ring] + o.centre
    assert hole.real.min() == pytest.approx(2)


def test_rings_that_touch_are_refused_with_their_place():
    touching = ROOM.difference(Polygon([(2, 0), (2.5, 0.5), (1.5, 0.5)]))
    with pytest.raises(UnmappableError, match=r"touches another at \(2, 0\) m") as caught:
        outline(touching, Point(1, 1))
    assert caught.value.place == (2.0, 0.0)
    assert caught.value.width == 0.0
    assert caught.value.angle is None


@pytest.mark.parametrize("shape", [domains.needle(0.9), domains.blade(359.1)], ids=["needle", "blade"])
def test_corners_sharper_than_a_degree_are_refused_with_their_angle(shape):
    domain, goal = shape
    with pytest.raises(UnmappableError, match="has an interior angle of") as caught:
        outline(domain, goal)
    assert min(caught.value.angle, 360 - caught.value.angle) == pytest.approx(0.9)
    assert Point(caught.value.place).distance(domain.boundary) < 1e-9
    assert caught.value.width is None


def test_a_third_coordinate_is_left_out():
    raised = Polygon([(0, 0, 5), (4, 0, 5), (4, 2, 5), (0, 2, 5)])
    assert outline(raised, Point(1, 1)).diameter == pytest.approx(np.hypot(4, 2))
