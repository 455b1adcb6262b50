import numpy as np
import pytest
from shapely import Polygon, box

from coop_drake.geometry.distances import separated
from coop_drake.geometry.sweeps import (
    circumscribed,
    closed_directions,
    edge_directions,
    half_planes_polygon,
    normals,
    support,
)

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_supports_at_the_edges_rebuild_the_polygon() -> None:
    directions = closed_directions(edge_directions(SQUARE), 0.75 * np.pi)
    rebuilt = Polygon(circumscribed(directions, support(SQUARE, directions)))
    assert rebuilt.symmetric_difference(Polygon(SQUARE)).area == pytest.approx(0.0, abs=1e-7)


def test_directions_are_closed_and_distinct() -> None:
    directions = closed_directions(np.array([0.0, 0.0, 1e-9, 6.2]), 0.5)
    gaps = np.diff(np.append(directions, directions[0] + 2 * np.pi))
    assert gaps.min() > 0.0
    assert gaps.max() <= 0.5 + 1e-12


def test_half_planes_of_a_polygon_rebuild_it_from_inside() -> None:
    angles = edge_directions(SQUARE)
    offsets = (normals(angles) * SQUARE).sum(axis=1)
    rebuilt = half_planes_polygon(angles, offsets)
    assert Polygon(SQUARE).contains(Polygon(rebuilt))
    assert Polygon(rebuilt).area == pytest.approx(1.0, abs=1e-7)


def test_redundant_and_repeated_half_planes_change_nothing() -> None:
    angles = np.concatenate((edge_directions(SQUARE), edge_directions(SQUARE), [0.3]))
    offsets = np.concatenate(((normals(edge_directions(SQUARE)) * SQUARE).sum(axis=1), [5.0] * 5))
    rebuilt = half_planes_polygon(angles, offsets)
    assert Polygon(rebuilt).area == pytest.approx(1.0, abs=1e-7)


def test_half_planes_that_exclude_each_other_leave_nothing() -> None:
    angles = np.array([0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi])
    assert len(half_planes_polygon(angles, np.array([1.0, -2.0, 1.0, 1.0]))) == 0


@pytest.mark.parametrize(("shift", "apart"), [(1.1, True), (0.9, False), (-1.1, True), (0.0, False)])
def test_squares_are_told_apart(shift: float, apart: bool) -> None:
    other = SQUARE + np.array([shift, 0.2])
    assert separated(SQUARE, other) is apart
    assert separated(SQUARE, other) is box(0, 0, 1, 1).disjoint(Polygon(other))


def test_gap_shifts_the_verdict() -> None:
    other = SQUARE + np.array([1.05, 0.0])
    assert separated(SQUARE, other, 0.04)
    assert not separated(SQUARE, other, 0.06)
    assert separated(SQUARE, SQUARE + np.array([0.99, 0.0]), -0.02)
