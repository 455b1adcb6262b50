"""Where a footprint may stand: nowhere, where only a line or nothing of the positions asked about is left."""

import numpy as np
import pytest
from shapely import LineString, MultiPolygon, Point, box

from coop_drake.verification.floor_edges import floor_edges
from coop_drake.verification.free_positions import fitting_positions, without_slivers

FLOOR = box(0.0, 0.0, 1.0, 1.0)
SQUARE = 0.2 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    "among", [box(1.0, 0.0, 2.0, 1.0), box(3.0, 0.0, 4.0, 1.0), LineString([(0.2, 0.2), (0.5, 0.5)])]
)
def test_lines_hold_no_free_position(among):
    fits = fitting_positions(floor_edges(FLOOR), SQUARE, among)
    assert fits.is_empty


def test_a_square_fits_where_its_lower_left_corner_may_stand():
    fits = fitting_positions(floor_edges(FLOOR), SQUARE, box(0.5, -1.0, 2.0, 2.0))
    assert fits.equals(box(0.5, 0.0, 0.8, 0.8))


def test_slivers_go_that_hold_no_disc_of_a_hair_unless_they_lie_beside_the_cover():
    hair = 1e-8
    disc, sliver = Point(0.5, 0.5).buffer(0.9 * hair), box(0.2, 0.2, 0.3, 0.2 + 1e-15)
    beside, cover = box(0.2, 0.9, 0.3, 0.9 + 1e-15), box(0.0, 0.9 + hair, 1.0, 2.0)
    left = without_slivers(MultiPolygon([disc, sliver, beside]), cover, hair)
    assert left.equals(MultiPolygon([disc, beside]))
    assert without_slivers(MultiPolygon([sliver]), MultiPolygon(), hair).is_empty
