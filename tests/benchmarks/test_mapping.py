"""Shapes to map are what they say, and rows name what they stand beside."""

import pytest
from shapely import Point, Polygon, box

from benchmarks.domains import Domain, hall_with_pillars, standard_domains, wavy_room
from benchmarks.map_rows import RESIDUAL, cost_rows, map_rows
from benchmarks.mapping import PILLARS, VERTICES


@pytest.mark.parametrize("domain", standard_domains().values(), ids=standard_domains())
def test_shapes_are_valid_and_hold_their_goals(domain):
    assert domain.cell.is_valid
    assert domain.cell.covers(domain.goal)


def test_rooms_have_as_many_corners_and_halls_as_many_pillars_as_asked():
    assert [wavy_room(count).vertices for count in VERTICES] == list(VERTICES)
    for count in PILLARS:
        hall = hall_with_pillars(count)
        assert len(hall.cell.interiors) == count
        assert hall.vertices == 4 + 4 * count
        assert hall.cell.contains(hall.goal)


def test_a_map_is_measured_beside_its_peers():
    square = Domain(box(0, 0, 1, 1), Point(0.5, 0.4))
    rows = {row.figure: row for row in map_rows("mapping/domains/square", square, 2e-3)}
    assert rows["answer"].unit == "mapped"
    assert 0.0 < rows["residual"].value <= RESIDUAL
    assert rows["residual"].peer_value == 2e-3
    assert rows["cpu_seconds"].peer == f"dense solve, {rows['unknowns'].value} unknowns"
    assert all(rows[figure].ratio > 0.0 for figure in ("cpu_seconds", "one_point", "per_point_of_1000"))


def test_a_shape_that_is_refused_is_a_row_too():
    needle = Domain(Polygon([(0, 0), (3, 0), (0, 0.01)]), Point(0.1, 0.003))
    rows = cost_rows("mapping/growth/needle", needle)
    assert [(row.figure, row.unit) for row in rows] == [("answer", "refused"), ("vertices", "-")]
