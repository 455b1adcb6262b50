"""Where a footprint may stand: nowhere, where only a line or nothing of the positions asked about is left."""

import numpy as np
import pytest
from shapely import LineString, box

from coop_drake.verification.may_be_free import fitting_positions
from coop_drake.verification.walls import wall_edges

FLOOR = box(0.0, 0.0, 1.0, 1.0)
SQUARE = 0.2 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    "among", [box(1.0, 0.0, 2.0, 1.0), box(3.0, 0.0, 4.0, 1.0), LineString([(0.2, 0.2), (0.5, 0.5)])]
)
def test_lines_hold_no_free_position(among):
    fits = fitting_positions(wall_edges(FLOOR), SQUARE, among)
    assert fits.is_empty


def test_a_square_fits_where_its_lower_left_corner_may_stand():
    fits = fitting_positions(wall_edges(FLOOR), SQUARE, box(0.5, -1.0, 2.0, 2.0))
    assert fits.equals(box(0.5, 0.0, 0.8, 0.8))
