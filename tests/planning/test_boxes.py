"""The compiled boxes and clearances agree with exact footprints and with the cells that are proved."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.sweeps import over_piece
from coop_drake.geometry.swept_tree import BodyPairs, SweptTree
from coop_drake.planning.boxes import box_arrays, box_clearance, room_for_sweeps, sweeps_apart, swept_piece
from coop_drake.planning.cells.cells import CellMaker
from coop_drake.planning.sampling.collision import FAR, grid_inside, lay_grid, team_clearance
from coop_drake.tree.team_arrays import place, team_arrays
from tests.support.trees import configurations, footprint, room, slices_of, trees

# The compiled clearances that steer the search agree with exact footprints and with the proved cells.

SLOW = settings(max_examples=15)
ROUNDING = 2e-3


@SLOW
@given(st.data())
def test_a_configuration_is_as_far_from_the_walls_as_its_footprint(data: st.DataObject) -> None:
    tree = data.draw(trees())
    grid = lay_grid(polygon_rings(room()), 2.0)
    position = tuple(data.draw(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))))
    for z in configurations(data.draw(slices_of(tree)), seed=4, count=4, position=position):
        found = team_clearance(team_arrays(tree), grid, place(team_arrays(tree), z), 0.5)
        shape = footprint(tree, z)
        exact = room().boundary.distance(shape)
        if room().contains(shape) and exact > ROUNDING:
            assert found == pytest.approx(min(exact, 0.5), abs=ROUNDING)
        elif not room().intersects(shape) or exact == 0.0:
            assert found <= ROUNDING


@pytest.mark.slow
@SLOW
@given(st.data())
def test_a_box_has_the_clearance_of_its_cell(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    pairs = BodyPairs(swept)
    boxes, grid = box_arrays(swept, pairs), grid_inside(room(), tree.reach)
    bounds = np.array(intervals)

    def clearance(position: np.ndarray) -> float:
        return box_clearance(boxes, grid, bounds[:, 0].copy(), bounds[:, 1].copy(), position, 0, 0, 1e-3)

    regions = CellMaker(swept, pairs, room()).under_cells(intervals)
    for region in regions:
        middle = region.rings[0].mean(axis=0, keepdims=True)
        depth = max(float(other.depths(middle)[0]) for other in regions)
        found = min(clearance(middle), FAR)
        assert found == pytest.approx(min(depth, FAR), abs=1e-5) if depth > 2e-3 else found < 2.1e-3
    if not regions:
        for position in np.random.default_rng(5).uniform(-3.0, 3.0, (5, 2)):
            inside = clearance(position[None]) >= 0.0
            assert not (inside and room().covers(footprint(tree, _middle(intervals, position))))


def _middle(intervals: tuple, position: np.ndarray) -> np.ndarray:
    return np.array([*position, *[0.5 * (lower + upper) for lower, upper in intervals]])


# A box sweeps each piece once; what pairs of bodies need is the sweep over the first joints of a piece.

SOME = settings(max_examples=25)


@SOME
@given(st.data())
def test_sweeps_are_those_of_each_piece_and_bodies_touch_where_pairs_do(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    pairs = BodyPairs(swept)
    boxes, bounds = box_arrays(swept, pairs), np.array(intervals)
    lower, upper = bounds[:, 0].copy(), bounds[:, 1].copy()
    sweeps, vertices, row = room_for_sweeps(len(boxes.pair_sweeps)), np.empty((1, 2)), 0
    for piece in reversed(range(len(swept.pieces))):
        ring, vertices, row = swept_piece(boxes, piece, lower, upper, sweeps, vertices, row)
        assert (ring == over_piece(boxes.team, piece, lower, upper, len(boxes.team.links), True)).all()
    assert row == len(boxes.pair_sweeps)
    for k, (piece, stages) in enumerate(boxes.pair_sweeps.tolist()):
        kept = vertices[sweeps.first[k] : sweeps.first[k + 1]]
        assert (kept == over_piece(boxes.team, piece, lower, upper, stages, False)).all()
    assert sweeps_apart(boxes, sweeps, vertices) == (pairs.touching(intervals) is None)
