"""Under-cells lie inside free space, free space inside over-cells, at a million configurations."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Point, Polygon
from shapely.affinity import scale

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from tests.support.free_positions import FreePositions, nudges
from tests.support.shapes import floors
from tests.support.trees import body_footprints, configurations, room, slices_of, trees

SLOW = settings(max_examples=40)
MANY_SLICES = settings(SLOW, max_examples=170)
ANGLES, POSITIONS = 4, 1_500  # 170 slices x 4 angles x 1,500 positions: a million configurations


@SLOW
@given(st.data())
def test_every_piece_stays_between_its_sweeps(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    poses = [tree.poses(z) for z in configurations(intervals, seed=1, count=60)]
    for index, piece in enumerate(swept.pieces):
        copies = np.array([X_WC[piece.component].apply(piece.shape.vertices) for X_WC in poses])
        over = swept.over(index, intervals)
        outline, corners = Polygon(over), shapely.points(copies.reshape(-1, 2))
        assert shapely.covers(outline, corners).all()
        assert shapely.distance(outline.exterior, corners).min() >= piece.shape.radius - 1e-11
        under = swept.under(index, intervals)
        if under is not None:
            cores = shapely.convex_hull(shapely.multipoints(copies))
            far = shapely.distance(cores[:, None], shapely.points(under)[None, :])
            assert far.max() <= piece.shape.radius + 1e-11


@pytest.mark.slow
@MANY_SLICES
@given(st.data())
def test_under_cells_are_free_and_free_space_is_in_over_cells(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    size = data.draw(st.sampled_from((1.0, 3.0, 6.0)))
    workspace = scale(data.draw(floors()), size, size, origin=(0.0, 0.0))
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    swept = SweptTree(tree)
    maker = CellMaker(swept, workspace)
    under, over = union(maker.under_cells(intervals)), union(maker.over_cells(intervals))
    for z in configurations(intervals, seed=int(random.integers(1 << 30)), count=ANGLES):
        exact = FreePositions(tree, workspace, z[2:])
        positions = np.concatenate(
            (
                exact.contacts(random, POSITIONS // 4),
                near_boundary(under, random, POSITIONS // 4),
                near_boundary(over, random, POSITIONS // 4),
                random.uniform(workspace.bounds[:2], workspace.bounds[2:], (POSITIONS // 4, 2)),
            )
        )
        free = exact.free(positions)
        assert free[shapely.contains_xy(under, positions)].all()
        assert shapely.contains_xy(over, positions[free]).all()


def union(regions: list[Region]) -> MultiPolygon:
    whole = MultiPolygon([to_polygon(region.section) for region in regions])
    shapely.prepare(whole)
    return whole


def near_boundary(shape: MultiPolygon, random: np.random.Generator, count: int) -> np.ndarray:
    """Points at corners and along edges of a shape, a hair aside; around the origin if it is empty."""
    corners = shapely.get_coordinates(shape) if not shape.is_empty else np.zeros((1, 2))
    first = random.integers(len(corners), size=count)
    last = np.minimum(first + 1, len(corners) - 1)
    share = random.random((count, 1)) * (random.random((count, 1)) < 0.5)
    return corners[first] + share * (corners[last] - corners[first]) + nudges(random, count)


@SLOW
@given(st.data())
def test_pairs_judge_like_exact_footprints(data: st.DataObject) -> None:
    tree = data.draw(trees(robots=(2, 3)))
    intervals = data.draw(slices_of(tree))
    pairs = SweptTree(tree).pairs
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
    maker = CellMaker(swept, room())
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
