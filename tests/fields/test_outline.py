import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.errors import FieldError
from coop_drake.fields.outline import outline_of, region_to_map

ROOM = box(0, 0, 4, 2)
FRAME = box(0.5, 0.2, 3.5, 1.8).difference(box(1, 0.6, 3, 1.4))
POSTS = box(1.9, 0.5, 2.1, 0.7).union(box(1.9, 1.3, 2.1, 1.5))


def outline(domain, goal, inside=None):
    return outline_of(region_to_map(domain, goal, inside), goal)


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


def test_inside_selects_the_piece_of_a_split_domain():
    goal = box(1, 0, 2, 2)
    assert region_to_map(ROOM, goal, Point(0.5, 1)).area == pytest.approx(2)
    assert region_to_map(ROOM, goal, Point(3, 1)).area == pytest.approx(4)


@pytest.mark.parametrize(
    ("domain", "goal", "inside", "message"),
    [
        (ROOM, Point(5, 1), None, "must lie strictly inside the domain"),
        (ROOM, Point(4, 1), None, "must lie strictly inside the domain"),
        (ROOM, box(3, 0, 5, 2), None, "goal region must lie in the domain"),
        (ROOM, Polygon(), None, "one valid polygon with an area"),
        (
            Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]),
            Point(0.5, 0.2),
            None,
            "the domain must be one valid polygon",
        ),
        (ROOM, box(1, 0, 2, 2), None, "has 2 pieces to choose from: the argument `inside`"),
        (ROOM, box(1, 0, 2, 2), Point(1.5, 1), "outside the domain or inside the goal"),
        (ROOM, ROOM, None, "has 0 pieces"),
        (ROOM.difference(POSTS), FRAME.difference(POSTS), Point(1.5, 1), "in 2 arcs; only one can collapse"),
        (ROOM, FRAME, Point(1.5, 1), "leave nothing of it"),
    ],
)
def test_unusable_questions_are_refused(domain, goal, inside, message):
    with pytest.raises(FieldError, match=message):
        outline(domain, goal, inside)
