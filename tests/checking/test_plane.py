"""Exact plane geometry against shapely and rational arithmetic, in units of 2^-80 m."""

from fractions import Fraction
from itertools import pairwise
from math import cos, inf, isqrt, nan, sin

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPoint, Point, Polygon

from coop_drake.checking import RefusedError, check, plane, regions, team
from coop_drake.checking.infeasible import WIDENING, _check_cover, _inside, _squeezed
from coop_drake.checking.plane import (
    BITS,
    ONE,
    TURN,
    apart,
    below,
    cosine_and_sine,
    difference,
    hull,
    numbers,
)
from coop_drake.checking.regions import FULL, Convex, Region
from coop_drake.checking.team import Question, Step, intervals, swept, unwrapped

# Exact plane geometry against the geometry that it must agree with: shapely, and rational arithmetic.

PLACE = st.tuples(st.integers(-9, 9), st.integers(-9, 9))
PLACES = st.lists(PLACE, min_size=1, max_size=7)
SEGMENT = st.lists(PLACE, min_size=2, max_size=2, unique=True)


@pytest.fixture(autouse=True)
def enough_work():
    plane.work_left[0] = 10**9


def region(*rings):
    return Region([list(ring) for ring in rings])


@given(st.floats(-1e3, 1e3))
def test_sines_and_cosines_are_right_to_a_unit(angle):
    exact = numbers([angle], 1)[0]
    c, s = cosine_and_sine(exact)
    assert abs(c / ONE - cos(angle)) < 1e-13 > abs(s / ONE - sin(angle))
    assert abs(c * c + s * s - ONE * ONE) <= 4 * ONE
    c2, s2 = cosine_and_sine(2 * exact)
    assert abs(c2 * ONE - (c * c - s * s)) <= 8 * ONE
    assert abs(s2 * ONE - 2 * c * s) <= 8 * ONE
    c3, s3 = cosine_and_sine(exact + TURN)
    assert max(abs(c3 - c), abs(s3 - s)) <= 4


def test_a_turn_is_two_pi():
    tau = Fraction("6.283185307179586476925286766559005768394338798750")
    assert 0 <= tau - Fraction(TURN, ONE) < Fraction(1, ONE)


@given(st.floats(-1e6, 1e6))
def test_numbers_are_doubles_to_a_multiple_of_a_unit(value):
    (exact,) = numbers([value], 1)
    assert abs(Fraction(exact, 1 << BITS) - Fraction(value)) <= Fraction(1, 2 << BITS)


@pytest.mark.parametrize("value", [nan, inf, 1e25, 10**400, True, None, "1", [], {}])
def test_what_is_no_number_of_metres_or_radians_is_refused(value):
    with pytest.raises(RefusedError, match="are not 1 between"):
        numbers([value], 1)


@given(PLACES, PLACES)
def test_edges_in_order_of_their_directions_bound_all_differences(first, second):
    first, second = hull(first), hull(second)
    found = difference(first, second)
    assert hull(found) == hull((p - x, q - y) for p, q in first for x, y in second)
    assert len(found) <= len(first) + len(second)
    assert area(found) == area(hull(found))


def area(ring):
    """Twice the area that a ring runs around counter-clockwise."""
    return sum(x * q - y * p for (x, y), (p, q) in pairwise([ring[-1], *ring]))


@given(PLACES, PLACES, st.integers(-3, 2))
def test_corners_are_inside_a_piece_by_more_than_a_depth(points, corners, depth):
    """A corner outside may be refused though it is nearer by less than a unit, here a hundredth."""
    points, corners = ([(100 * x, 100 * y) for x, y in places] for places in (points, corners))
    polygon, depth, expected = MultiPoint(corners).convex_hull, 100 * depth, True
    for point in map(Point, points):
        away = polygon.boundary.distance(point) if isinstance(polygon, Polygon) else polygon.distance(point)
        inside = away if isinstance(polygon, Polygon) and polygon.contains(point) else -away
        if abs(inside - depth) < 2.0:
            return
        expected = expected and inside > depth
    assert _inside(hull(corners), points, depth) == expected


@given(SEGMENT, st.lists(PLACE, min_size=3, max_size=7))
def test_the_stretch_in_a_convex_polygon_is_all_of_its_interior(edge, corners):
    ring = hull(corners)
    if len(ring) < 3:
        assert region(ring).stretches(edge) == []
        return
    inside = LineString(edge).intersection(Polygon(ring)).length
    inside = 0.0 if LineString(edge).relate_pattern(Polygon(ring), "F********") else inside
    found = sum(high - low for low, high in region(ring).stretches(edge)) / FULL * LineString(edge).length
    assert found == pytest.approx(inside, abs=1e-9)


@given(SEGMENT, st.lists(PLACE, min_size=1, max_size=7))
@settings(max_examples=300)
def test_a_convex_set_has_the_stretches_of_the_region_in_its_ring(edge, corners):
    ring = hull(corners)
    made, found = region(ring), Convex(ring).stretches(edge)
    lengths = [sum(high - low for low, high in each) for each in (found, made.stretches(edge))]
    assert len(found) <= 1
    assert abs(lengths[0] - lengths[1]) <= 10
    for place in (place for stretch in found for place in stretch):
        x, y = (a * FULL + (b - a) * place for a, b in zip(*edge, strict=True))
        assert made.has_inside(x, y, FULL)
        assert all(off_edge((x, y), side) for side in made.edges)


@given(SEGMENT, st.lists(PLACE, min_size=3, max_size=6), st.lists(PLACE, min_size=3, max_size=5))
@settings(max_examples=200)
def test_stretches_in_a_region_hold_all_points_of_their_parity_that_are_on_no_edge(edge, outer, hole):
    made = region(outer, hole)
    even = Region(made.rings, odd=False)
    inside, outside = made.stretches(edge), even.stretches(edge)
    assert covered(inside + outside) >= FULL - 100
    for odd, stretches in ((True, inside), (False, outside)):
        for low, high in stretches:
            for place in {low, (low + high) // 2, high}:
                x, y = (a * FULL + (b - a) * place for a, b in zip(*edge, strict=True))
                assert made.has_inside(x, y, FULL) == odd
                assert all(off_edge((x, y), side) for side in made.edges)


def covered(stretches):
    return sum(high - low for low, high in stretches) + collinear_allowance(stretches)


def collinear_allowance(stretches):
    """What lies between stretches: single places, or edges on the segment's own line."""
    ends = sorted(stretches)
    gaps = [b[0] - a[1] for a, b in pairwise(ends)]
    return sum(gaps) + (ends[0][0] + FULL - ends[-1][1] if ends else FULL)


def off_edge(point, edge):
    (px, py), (qx, qy) = ((x * FULL, y * FULL) for x, y in edge)
    if edge[0] == edge[1]:
        return point != (px, py)
    across = (qx - px) * (point[1] - py) - (qy - py) * (point[0] - px)
    along = (qx - px) * (point[0] - px) + (qy - py) * (point[1] - py)
    return across != 0 or not 0 <= along <= (qx - px) ** 2 + (qy - py) ** 2


@given(st.lists(PLACE, min_size=3, max_size=5), st.lists(PLACE, min_size=3, max_size=5))
def test_regions_touch_if_they_share_a_point(first, second):
    one, other = region(first), region(second)
    polygons = Polygon(first), Polygon(second)
    if one.edges and other.edges and all(polygon.is_valid for polygon in polygons):
        assert one.touches(other) == polygons[0].intersects(polygons[1]) == other.touches(one)


@given(
    st.lists(st.tuples(st.integers(20, 60), st.integers(-9, 9)), min_size=60, max_size=90),
    st.tuples(st.integers(-50, 50), st.integers(-60, 60), st.integers(0, 30), st.integers(0, 30)),
    st.integers(0, 12),
)
def test_edges_near_a_box_are_found_in_squares_as_among_all(offsets, place, gap):
    around = [
        (int(radius * cos(0.1 * k)), int(radius * sin(0.1 * k)) + jump)
        for k, (radius, jump) in enumerate(offsets)
    ]
    many, (x, y, width, height) = region(around), place
    box = x, y, x + width, y + height
    assert len(many.edges) > regions.MANY
    near = [k for k, its in enumerate(many.boxes) if not plane.boxes_apart(its, box, gap)]
    assert sorted(many.near(box, gap)) == near
    assert sum(map(len, many.squares[1].values())) <= 7 * len(many.edges)


def test_a_point_is_inside_a_region_of_many_edges_as_in_shapely():
    star = [(round((40 + 30 * (k % 2)) * cos(k / 16)), round(70 * sin(k / 16))) for k in range(100)]
    many, shape = region(star), Polygon(star)
    for x in range(-70, 71, 7):
        for y in range(-73, 74, 7):
            if not shape.boundary.intersects(Point(x + 0.5, y + 0.5)):
                assert many.has_inside(2 * x + 1, 2 * y + 1, 2) == shape.buffer(0).contains(
                    Point(x + 0.5, y + 0.5)
                )


# Cells, forbidden positions and squeezes must cover the plane: what they do not cover may be free.


def rectangle(x0, y0, x1, y1):
    return [(round(x * ONE), round(y * ONE)) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]


def outside(*box):
    return Region([rectangle(*box)], odd=False)


def test_the_edges_of_a_squeeze_that_covers_a_cell_are_covered_themselves():
    cells, squeezes = [Region([rectangle(2, 2, 3, 3)])], [Region([rectangle(0, 0, 9, 9)])]
    with pytest.raises(RefusedError, match="no cell covers"):
        _check_cover(cells, squeezes, [], outside(-20, -20, 20, 20), "slices[0]")


@pytest.mark.parametrize(("half", "covered"), [(0.5, True), (0.1, False)])
def test_walls_forbid_positions_by_each_of_two_witnesses(half, covered):
    # Mean corners are on the floor for x from 1.7 to 5.7 and from -2 to 2: both are between 1.7 and 2, where
    # only the second witness, if it is wide enough, meets the wall at x = 4.
    witnesses = [rectangle(-1.8, -0.1, -1.6, 0.1), rectangle(2 - half, -half, 2 + half, half)]
    floor = outside(0, -10, 4, 10)
    if covered:
        assert _check_cover([], [], witnesses, floor, "slices[0]") > 0
    else:
        with pytest.raises(RefusedError, match="no cell covers"):
            _check_cover([], [], witnesses, floor, "slices[0]")


# What the exact checker constructs encloses, compared with rational arithmetic, in units of 2^-80 m.

NEAR = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
RINGS = st.lists(NEAR, min_size=1, max_size=6)
CUTS = st.lists(st.tuples(NEAR, st.integers(0, 5), st.integers(-3, 3)), min_size=1, max_size=4)
TWO_PI = Fraction("6.283185307179586476925286766559005768394338798750211641949889") * ONE


def square_distance(point, ring):
    """Of a point to a convex ring, counter-clockwise, as a fraction; 0 inside."""
    (x, y), found = point, []
    inside = len(ring) > 2
    for (ax, ay), (bx, by) in pairwise([ring[-1], *ring]):
        dx, dy = bx - ax, by - ay
        along = Fraction((x - ax) * dx + (y - ay) * dy, (dx * dx + dy * dy) or 1)
        share = min(max(along, 0), 1)
        found.append((ax + share * dx - x) ** 2 + (ay + share * dy - y) ** 2)
        inside = inside and dx * (y - ay) - dy * (x - ax) >= 0
    return Fraction(0) if inside else min(found)


def cut_exactly(ring, direction, bound):
    """Corners of the part of a convex ring where direction . x <= bound, as fractions."""
    found, (u, v) = [], direction
    levels = [(p, u * p[0] + v * p[1] - bound) for p in ring]
    for (a, s), (b, t) in pairwise([levels[-1], *levels]):
        if (s < 0 < t) or (t < 0 < s):
            share = Fraction(s) / (s - t)
            found.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
        found += [b] if t <= 0 else []
    return found


@given(RINGS, RINGS)
def test_rings_with_corners_that_repeat_or_lie_on_a_line_are_refused_or_taken_rightly(first, second):
    try:
        found = difference(first, second)
    except RefusedError:
        assert first != hull(first) or second != hull(second)
        return
    assert hull(found) == hull((a - c, b - d) for a, b in first for c, d in second)
    assert len(found) == len(hull(found))


@given(RINGS, RINGS, st.integers(0, 3))
def test_sets_are_apart_if_their_distance_is_larger_than_the_gap(first, second, gap):
    first, second = hull(first), hull(second)
    origin = square_distance((0, 0), hull((a - c, b - d) for a, b in first for c, d in second))
    assert apart(first, second, gap) == (origin > gap * gap)


@pytest.mark.parametrize(
    "ring",
    [
        [(0, 0), (10, 0), (10, 0), (0, 0)],
        [(0, 0), (5, 0), (10, 0)],
        [(0, 0), (10, 0), (10, 0), (10, 9)],
        [(0, 0), (10, 0), (10, 5), (10, 9)],
        [(0, 0), (0, 9), (10, 0)],
        [(0, 4), (-3, -4), (4, 1), (-4, 1), (3, -4)],
    ],
    ids=["flat box", "on a line", "repeated", "collinear", "clockwise", "twice round"],
)
def test_a_ring_that_is_not_strictly_convex_is_refused(ring):
    segment = [(2, -3), (2, 3)]
    for pair in ((ring, segment), (segment, ring)):
        with pytest.raises(RefusedError, match="repeat, lie on a line, or are not in a convex order"):
            apart(*pair, 0)


@given(st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=1, max_size=7), CUTS)
def test_cuts_within_three_units_of_a_corner_leave_a_convex_ring_about_what_is_left(corners, cuts):
    found, grown, exact = hull(corners), 0, hull(corners)
    for (u, v), corner, distance in cuts:
        assume((u, v) != (0, 0))
        x, y = found[corner % len(found)]
        bound = u * x + v * y + distance * isqrt(u * u + v * v)
        exact = cut_exactly(exact, (u, v), bound) if exact else exact
        found, grown = below(found, grown, (u, v), bound)
        assert found == hull(found)
        if not found:
            assert not exact
            return
        difference(found, [(0, 0)])
        assert all(square_distance(point, found) <= grown * grown for point in exact)


@given(RINGS, NEAR, st.integers(-3, 3), st.integers(0, 3), st.floats(0, 6.3))
def test_the_cut_of_a_grown_set_holds_its_points_beyond_the_corners(corners, direction, level, grown, angle):
    ring, (u, v) = hull(corners), direction
    found, after = below(ring, grown, direction, level)
    for x, y in ring:
        point = x + grown * cos(angle), y + grown * sin(angle)
        if u * point[0] + v * point[1] <= level:
            assert found
            nearest = square_distance((Fraction(point[0]), Fraction(point[1])), found)
            assert nearest <= (after + Fraction(1, 10**9)) ** 2


ANGLE = st.integers(-3, 3)


@given(
    st.integers(-9, 9), ANGLE, ANGLE, st.integers(0, 5), st.integers(0, 5), st.booleans(), st.integers(0, 3)
)
def test_angles_are_unwrapped_outwards_for_proofs_and_inwards_for_plans(turns, a, b, wide, width, half, part):
    """Angles that are whole or half turns away, but for some units."""
    away = int(TWO_PI * (turns + Fraction(half, 2)))
    size = part * (TURN // 4)
    about, angles = (b, b + width + size), (away + a, away + a + wide + (TURN // 2 - size if half else 0))
    true = [(angles[0] + n * TWO_PI, angles[1] + n * TWO_PI) for n in range(-12, 13)]
    outer, inner = (unwrapped(angles, about, outwards=side) for side in (1, -1))
    assert any(outer[0] <= low and high <= outer[1] for low, high in true)
    assert any(low <= inner[0] and inner[1] <= high for low, high in true)
    if any(low <= about[1] and about[0] <= high for low, high in true):
        assert outer[0] <= about[1]
        assert about[0] <= outer[1]


@given(
    st.lists(NEAR, min_size=1, max_size=4),
    st.floats(-7, 7),
    st.floats(0, 7),
    st.floats(-2, 2),
    st.tuples(NEAR, NEAR),
    st.floats(0, 1),
)
def test_what_moves_stays_in_its_enclosure_though_it_is_a_few_units_large(
    corners, low, wide, angle, by, share
):
    """A turn with a slide, then another turn the other way about a point some units away."""
    box = [tuple(round(end * ONE) for end in (low, low + wide)) for _ in range(2)]
    slide, offset = by
    steps = [Step(0, 1, round(angle * ONE), slide, offset), Step(1, -1, 0, (0, 0), offset)]
    found, grown = swept(hull(corners), 1, steps, box)
    assert found == hull(found)
    values = low + share * wide, low + (1 - share) * wide
    for x, y in corners:
        for step, value in zip(steps, values, strict=True):
            turn = step.sign * value + step.angle / ONE
            c, s = cos(turn), sin(turn)
            x, y = c * x - s * y + value * step.slide[0], s * x + c * y + value * step.slide[1]
            x, y = x + step.offset[0], y + step.offset[1]
        away = float(square_distance((Fraction(x), Fraction(y)), found)) ** 0.5
        assert away + 1 <= grown + 1e-9


def test_repeated_corners_make_no_edges_and_a_point_makes_one():
    square = Region([[(0, 0), (9, 0), (9, 0), (9, 9), (0, 9), (0, 0)]])
    assert len(square.edges) == 4
    assert square.side([(4, 4)], 3) == 1
    for point in (Region([[(3, 4)]]), Region([[(3, 4), (3, 4), (3, 4)]])):
        assert {*point.edges} == {((3, 4), (3, 4))}
        assert [point.side([corner], 4) for corner in ((0, 0), (0, 2), (3, 4))] == [-1, 0, 0]


BAR = [[-2, -0.05], [2, -0.05], [2, 0.05], [-2, 0.05]]
CORRIDOR = {
    "format": "coop_drake question", "version": 3,
    "floor": {"outer": [[-10, 0], [10, 0], [10, 1.0], [-10, 1.0]], "holes": []},
    "lower": [-0.1, -0.1], "upper": [0.1, 0.1],
    "components": [
        {"parent": 0, "joint": joint, "sign": 1, "angle": 0.0, "slide": [0, 0], "offset": [x, 0]}
        for joint, x in ((0, -0.5), (1, 0.5))
    ],
    "pieces": [
        {"body": "bar", "component": 0, "corners": BAR, "radius": 0.0},
        {"body": "disc_0", "component": 1, "corners": [[0, 0]], "radius": 0.25},
        {"body": "disc_1", "component": 2, "corners": [[0, 0]], "radius": 0.25},
    ],
    "left_aside": [[0, 1, "joint"], [0, 2, "joint"]], "start": [-6, 0.5, 0, 0, 0], "goal": [6, 0.5],
    "goal_lower": [0, -0.1, -0.1], "goal_upper": [0, 0.1, 0.1], "tolerances": [0.01, 0.02, 0.02, 0.02],
}  # fmt: skip
"""A bar between two discs in a corridor of 1 m, which it passes lengthwise."""

FORGED_SQUEEZE = {
    "component": 0,
    "pieces": [1, 2],
    "polygon": [[-1.1, -0.001], [2.4, 8.781607628650181e-17], [2.396, 0.02], [1.05, 1.2], [-1.1, 1.2]],
    "cuts": [
        {"piece": 1, "direction": [0.9104753818739809, 0.4135632708563812], "limit": 1.7299029157119663},
        {"piece": 0, "direction": [0, -1], "limit": -0.05899999999954531},
    ],
}
"""The first cut passes so near to a corner that rounding made a short edge with a wrong direction."""


def test_a_squeeze_whose_cut_passes_beside_a_corner_does_not_forbid_free_positions():
    question = Question(CORRIDOR)
    slice_of = intervals([-3.141592653589793, -0.1, -0.1], [-3.105967653589793, 0.1, 0.1], 3)
    box = [(low - WIDENING, high + WIDENING) for low, high in slice_of]
    with pytest.raises(RefusedError, match="may leave room between disc_0 and disc_1"):
        _squeezed(question, [Step(0, -1), *question.chains[0]], box, FORGED_SQUEEZE, "squeezes")
    moved, gap = team.swept(
        question.pieces[0].corners, 0, question.chains[0], [(-(TURN // 2),) * 2, (0, 0), (0, 0)]
    )
    free = [(x, y + ONE // 2) for x, y in moved]
    assert (
        question.floor.side(hull(free), gap) == 1
    )  # The position (0, 0.5) lies in the polygon, the bar is free.


def corners_of(x0, y0, x1, y1):
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def with_a_fringe(ring, first, last):
    """A ring with 120 corners on one axis-parallel line, between two of its corners."""
    (ax, ay), (bx, by) = ring[first], ring[last]
    fringe = [[ax + (bx - ax) * k / 1200, ay + (by - ay) * k / 1200] for k in range(1, 120)]
    return [*ring[: first + 1], *fringe, *ring[first + 1 :]]


def test_edges_on_one_line_that_cross_a_cell_are_not_taken_to_lie_inside_it():
    """A disc of 0.3 m can reach (5, 8) in a hall of 10 m: between the rings about the goal there are gaps."""
    rings = [
        with_a_fringe([[6.5, 5.9], [3.2, 5.9], [3.2, 7.5], [6.5, 7.5]], 2, 3),
        with_a_fringe([[3.2, 9.5], [3.2, 6.1], [4.5, 6.1], [4.5, 9.5]], 2, 3),
        with_a_fringe([[6.5, 9.6], [3.3, 9.6], [3.3, 8.5], [6.5, 8.5]], 2, 3),
        with_a_fringe([[6.6, 9.5], [6.6, 6.1], [5.5, 6.1], [5.5, 9.5]], 2, 3),
        [[4.7, 6.1], [4.4, 6.4], [4.1, 6.1], [4.4, 5.8]],
        [[5.7, 6.1], [5.4, 6.4], [5.1, 6.1], [5.4, 5.8]],
    ]
    around = {"outer": corners_of(-1, -1, 11, 11), "holes": [corners_of(3.6, 6.2, 6.2, 9.2)]}
    cells = [around, *({"outer": ring, "holes": []} for ring in rings)]
    disc = {"body": "disc", "component": 0, "corners": [[0.0, 0.0]], "radius": 0.3}
    hall = {
        "format": "coop_drake question", "version": 3,
        "floor": {"outer": corners_of(0, 0, 10, 10), "holes": []},
        "lower": [], "upper": [], "components": [], "pieces": [disc], "left_aside": [],
        "start": [5.0, 2.0, 0.0], "goal": [5.0, 8.0], "goal_lower": [0.0], "goal_upper": [0.0],
        "tolerances": [0.01, 0.01],
    }  # fmt: skip
    witness = {"pieces": [0], "component": 0, "polygon": corners_of(-0.1, -0.1, 0.1, 0.1)}
    whole = {"lower": [-3.141592653589793], "upper": [3.141592653589793], "witnesses": [witness]}
    whole["cells"] = [{"reached": True, "polygon": cell} for cell in cells]
    proof = {"format": "coop_drake proof of infeasibility", "version": 4, "component": 0, "point": [0, 0]}
    with pytest.raises(RefusedError, match="no cell covers"):
        check(hall, {**proof, "slices": [whole]})
