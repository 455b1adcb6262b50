"""Convex polygons and their sweeps, eq. (6); how far a team reaches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPoint, Point, Polygon, box
from shapely.affinity import rotate

from coop_drake.geometry.polygons import separated
from coop_drake.geometry.sweeps import (
    common_disc,
    grown,
    over_prismatic,
    over_revolute,
    under_prismatic,
    under_revolute,
)
from coop_drake.geometry.swept_tree import inscribed
from coop_drake.tree.component_tree import PlanarPose
from tests.support.trees import trees

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


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


RECTANGLE = np.array([[0.1, -0.1], [0.6, -0.1], [0.6, 0.1], [0.1, 0.1]])
ROUND_PIVOT = np.array([[-0.3, -0.2], [0.6, -0.2], [0.5, 0.3], [-0.2, 0.25]])
RINGS = st.sampled_from((RECTANGLE, ROUND_PIVOT, RECTANGLE + 0.3))
ANGLES = st.floats(-4.0, 4.0)
HALVES = st.floats(0.0, 3.5)


def turned(ring: np.ndarray, angle: float) -> Polygon:
    return rotate(Polygon(ring), angle, origin=(0.0, 0.0), use_radians=True)


@given(RINGS, ANGLES, HALVES, st.floats(-1.0, 1.0))
def test_every_turned_copy_lies_in_the_over_sweep(
    ring: np.ndarray, centre: float, half: float, share: float
) -> None:
    sweep = Polygon(over_revolute(ring, centre, half))
    assert sweep.is_valid
    assert sweep.covers(turned(ring, centre + share * half))


@given(RINGS, ANGLES, HALVES, st.floats(-1.0, 1.0))
def test_the_under_sweep_lies_in_every_turned_copy(
    ring: np.ndarray, centre: float, half: float, share: float
) -> None:
    sweep = under_revolute(ring, centre, half)
    if len(sweep):
        assert turned(ring, centre + share * half).covers(Polygon(sweep))


def test_many_turns_leave_no_more_than_one() -> None:
    """Chords of arcs that are longer than a turn would leap over what they stand for."""
    for turns in np.arange(1.0, 30.0, 0.5):
        sweep = under_revolute(ROUND_PIVOT, 0.3, turns * np.pi)
        assert len(sweep)
        assert np.hypot(*sweep.T).max() < 0.2


@given(st.integers(3, 24), st.integers(1, 12), st.floats(-0.2, 0.2), st.sampled_from((0.0, 0.1, 0.25)))
def test_lines_that_coincide_but_for_rounding_are_taken_at_the_innermost(
    corners: int, steps: int, turn: float, aside: float
) -> None:
    """Turned by a multiple of its own symmetry a ring's lines meet others of another offset."""
    bearings = turn + 2.0 * np.pi / corners * np.arange(corners)
    ring = 0.3 * np.column_stack((np.cos(bearings), np.sin(bearings))) + np.array([aside, 0.0])
    half = steps * np.pi / corners
    sweep = under_revolute(ring, 0.25 * np.pi, half)
    if len(sweep):
        for share in (-1.0, 0.0, 1.0):
            assert turned(ring, 0.25 * np.pi + share * half).covers(Polygon(sweep))


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), ANGLES, HALVES, st.floats(-1.0, 1.0))
def test_a_point_sweeps_an_arc(x: float, y: float, centre: float, half: float, share: float) -> None:
    sweep = MultiPoint(over_revolute(np.array([[x, y]]), centre, half)).convex_hull
    moved = rotate(Point(x, y), centre + share * half, origin=(0.0, 0.0), use_radians=True)
    assert sweep.buffer(1e-9).covers(moved)


@pytest.mark.parametrize("ring", [RECTANGLE, ROUND_PIVOT])
def test_excess_vanishes_with_the_slice(ring: np.ndarray) -> None:
    area = Polygon(ring).area
    excess = [Polygon(over_revolute(ring, 0.7, half)).area - area for half in (0.2, 0.02, 0.002)]
    assert excess[1] < 0.15 * excess[0]
    assert excess[2] < 0.15 * excess[1]
    missing = []
    for half in (0.02, 0.002, 0.0002):
        under = under_revolute(ring, 0.7, half)
        assert len(under)
        missing.append(area - Polygon(under).area)
    assert missing[1] < 0.15 * missing[0]
    assert missing[2] < 0.15 * missing[1]


def test_turning_by_pi_or_more_leaves_nothing_beside_the_pivot() -> None:
    assert under_revolute(RECTANGLE, 0.0, 0.5 * np.pi).size == 0
    full = under_revolute(ROUND_PIVOT, 0.0, np.pi)
    assert len(full)
    radius = Polygon(ROUND_PIVOT).exterior.distance(Point(0, 0))
    assert np.hypot(*full.T).max() <= radius


@given(RINGS, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.0, 1.0))
def test_prismatic_sweeps_are_exact(ring: np.ndarray, dx: float, dy: float, share: float) -> None:
    first, last = np.array([-0.05, 0.02]), np.array([dx, dy])
    over = Polygon(over_prismatic(ring, *first, *last))
    exact = MultiPoint(np.concatenate((ring + first, ring + last))).convex_hull
    assert over.covers(exact)
    assert over.area == pytest.approx(exact.area, abs=1e-6)
    under = under_prismatic(ring, *first, *last)
    common = Polygon(ring + first).intersection(Polygon(ring + last))
    if not len(under):
        assert common.area < 1e-6
    else:
        assert Polygon(ring + first + share * (last - first)).covers(Polygon(under))
        assert Polygon(under).area == pytest.approx(common.area, abs=1e-6)


@pytest.mark.parametrize("turn", [0.6, 0.1])
def test_grown_and_inscribed_bracket_a_capsule(turn: float) -> None:
    segment = np.array([[0.0, 0.0], [0.4, 0.1]])
    capsule = LineString(segment).buffer(0.1, quad_segs=256)
    outer, inner = Polygon(grown(segment, 0.1, turn)), Polygon(inscribed(segment, 0.1, turn))
    assert outer.buffer(1e-5).covers(capsule)
    assert capsule.buffer(1e-5).covers(inner)
    assert outer.area - inner.area < 0.02 * turn


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)), min_size=1, max_size=5))
def test_common_disc_lies_in_the_disc_about_every_centre(points: list[tuple[float, float]]) -> None:
    common = common_disc(np.array(points), 0.25, 0.2)
    if len(common):
        for x, y in points:
            assert np.hypot(common[:, 0] - x, common[:, 1] - y).max() <= 0.25


@settings(max_examples=40)
@given(st.data())
def test_no_point_of_the_team_is_beyond_its_reach(data: st.DataObject) -> None:
    tree = data.draw(trees())
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    for share in random.integers(0, 2, (20, len(tree.joints))):
        joints = tree.range_lower + share * (tree.range_upper - tree.range_lower)
        poses = tree.poses((0.0, 0.0, 0.7, *joints))
        for X_WC, component in zip(poses, tree.components, strict=True):
            for shape in (shape for body in component.bodies for shape in body.shapes):
                assert np.hypot(*X_WC.apply(shape.vertices).T).max() + shape.radius <= tree.reach + 1e-12


@settings(max_examples=40)
@given(st.data())
def test_poses_follow_one_from_the_other_along_the_joints(data: st.DataObject) -> None:
    """Eq. (3): a joint's frame stands on the parent, and the child turns or slides in it."""
    tree = data.draw(trees())
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    z = random.normal(size=3 + len(tree.joints))
    poses = tree.poses(z)
    assert poses[0] == PlanarPose(*z[:3])
    for X_WC, component in zip(poses[1:], tree.components[1:], strict=True):
        joint, q = component.joint, z[3 + component.joint.index]
        turns = joint.kind == "revolute"
        X_JC = PlanarPose(angle=joint.sign * q) if turns else PlanarPose(*(q * np.array(joint.axis)))
        expected = poses[component.parent] @ joint.X_PJ @ X_JC
        np.testing.assert_allclose(
            [X_WC.x, X_WC.y, X_WC.angle], [expected.x, expected.y, expected.angle], rtol=0.0, atol=1e-12
        )
