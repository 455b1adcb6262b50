"""Under-cells lie inside free space, free space inside over-cells."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.cells import CellMaker
from tests.support.trees import (
    body_footprints,
    configurations,
    footprint,
    placed_shape,
    room,
    slices_of,
    trees,
)

SLOW = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@SLOW
@given(st.data())
def test_every_piece_stays_between_its_sweeps(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    for z in configurations(intervals, seed=1, count=12):
        poses = tree.poses(z)
        for index, piece in enumerate(swept.pieces):
            exact = placed_shape(piece.shape, poses[piece.component], quad_segs=64)
            assert Polygon(swept.over(index, intervals)).buffer(1e-8).covers(exact)
            under = swept.under(index, intervals)
            if under is not None:
                assert exact.buffer(1e-4 * piece.shape.radius + 1e-9).covers(Polygon(under))


@SLOW
@given(st.data())
def test_under_cells_are_free_and_free_space_is_in_over_cells(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    maker = CellMaker(swept, BodyPairs(swept), room())
    under, over = maker.under_cells(intervals), maker.over_cells(intervals)
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    for position in random.uniform(-3.0, 3.0, (8, 2)):
        surely = any(region.holds(position) for region in under)
        maybe = any(region.holds(position) for region in over)
        for z in configurations(intervals, seed=2, count=10, position=tuple(position)):
            free = is_free(tree, z)
            assert free or not surely
            assert maybe or not free


def is_free(tree, z: np.ndarray) -> bool:
    bodies = body_footprints(tree, z)
    if not room().contains_properly(footprint(tree, z)):
        return False
    return all(bodies[a].disjoint(bodies[b]) for a, b in tree.collision_pairs)


@SLOW
@given(st.data())
def test_pairs_judge_like_exact_footprints(data: st.DataObject) -> None:
    tree = data.draw(trees(robots=(2, 3)))
    intervals = data.draw(slices_of(tree))
    pairs = BodyPairs(SweptTree(tree))
    touching, overlapping = pairs.touching(intervals), pairs.overlapping(intervals)
    for z in configurations(intervals, seed=3, count=10):
        bodies = body_footprints(tree, z)
        contact = [a for a, b in tree.collision_pairs if bodies[a].intersects(bodies[b])]
        if touching is None:
            assert not contact
        if overlapping is not None:
            assert contact


@SLOW
@given(st.data())
def test_halving_never_loosens(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    maker = CellMaker(swept, BodyPairs(swept), room())
    axis = data.draw(st.integers(0, len(intervals) - 1))
    lower, upper = intervals[axis]
    half = (*intervals[:axis], (lower, 0.5 * (lower + upper)), *intervals[axis + 1 :])
    whole_over, half_over = maker.over_cells(intervals), maker.over_cells(half)
    assert sum(r.area for r in half_over) <= sum(r.area for r in whole_over) + 5e-3
    for region in maker.under_cells(intervals):
        point = Point(*region.rings[0].mean(axis=0))
        if (
            region.holds(np.array([point.x, point.y]))
            and region.depths(np.array([[point.x, point.y]]))[0] > 0.02
        ):
            assert any(r.holds(np.array([point.x, point.y])) for r in maker.under_cells(half))
