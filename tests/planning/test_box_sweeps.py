"""A box sweeps each piece once; what pairs of bodies need is the sweep over the first joints of a piece."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.piece_sweeps import over_piece
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes import box_arrays, room_for_sweeps, sweeps_apart, swept_piece
from tests.support.trees import slices_of, trees

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
