"""What the exact checker constructs encloses, compared with rational arithmetic, in units of 2^-80 m."""

from fractions import Fraction
from itertools import pairwise
from math import cos, hypot, isqrt, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from coop_drake.checking import RefusedError, check, plane, team
from coop_drake.checking.infeasible import WIDENING, _Sets, _squeezed
from coop_drake.checking.plane import ONE, TURN, apart, below, difference, hull
from coop_drake.checking.regions import Region
from coop_drake.checking.team import Question, Step, intervals, swept, unwrapped

PLACE = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
RINGS = st.lists(PLACE, min_size=1, max_size=6)
CUTS = st.lists(st.tuples(PLACE, st.integers(0, 5), st.integers(-3, 3)), min_size=1, max_size=4)
TWO_PI = Fraction("6.283185307179586476925286766559005768394338798750211641949889") * ONE


@pytest.fixture(autouse=True)
def enough_work():
    plane.work_left[0] = 10**9


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


@given(RINGS, PLACE, st.integers(-3, 3), st.integers(0, 3), st.floats(0, 6.3))
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
    st.lists(PLACE, min_size=1, max_size=4),
    st.floats(-7, 7),
    st.floats(0, 7),
    st.floats(-2, 2),
    st.tuples(PLACE, PLACE),
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


@given(RINGS)
def test_the_mean_of_a_witness_is_less_than_two_units_off(corners):
    polygon = hull(corners)
    (_, (x, y)) = _Sets([], [polygon], Region([[(0, 0), (9, 0), (9, 9)]], odd=False)).known[0]
    mean = [sum(values) / len(polygon) for values in zip(*polygon, strict=True)]
    assert hypot(x + mean[0], y + mean[1]) < 2


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


def rectangle(x0, y0, x1, y1):
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
    around = {"outer": rectangle(-1, -1, 11, 11), "holes": [rectangle(3.6, 6.2, 6.2, 9.2)]}
    cells = [around, *({"outer": ring, "holes": []} for ring in rings)]
    disc = {"body": "disc", "component": 0, "corners": [[0.0, 0.0]], "radius": 0.3}
    hall = {
        "format": "coop_drake question", "version": 3,
        "floor": {"outer": rectangle(0, 0, 10, 10), "holes": []},
        "lower": [], "upper": [], "components": [], "pieces": [disc], "left_aside": [],
        "start": [5.0, 2.0, 0.0], "goal": [5.0, 8.0], "goal_lower": [0.0], "goal_upper": [0.0],
        "tolerances": [0.01, 0.01],
    }  # fmt: skip
    witness = {"pieces": [0], "component": 0, "polygon": rectangle(-0.1, -0.1, 0.1, 0.1)}
    whole = {"lower": [-3.141592653589793], "upper": [3.141592653589793], "witnesses": [witness]}
    whole["cells"] = [{"reached": True, "polygon": cell} for cell in cells]
    proof = {"format": "coop_drake proof of infeasibility", "version": 4, "component": 0, "point": [0, 0]}
    with pytest.raises(RefusedError, match="no cell covers"):
        check(hall, {**proof, "slices": [whole]})
