"""What is drawn is what was told: parts, lines, shadows, layers and cuts."""

from __future__ import annotations

from itertools import combinations, pairwise
from math import pi

import numpy as np
import pytest
from shapely import LineString, union_all

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.slices import holds, nearest_turn, share_facet
from coop_drake.watching import Strategy, record, storyboard
from coop_drake.watching.axes_view import cut
from coop_drake.watching.film import BOXES
from coop_drake.watching.shadows import Shadows
from coop_drake.watching.stack import THETA, Matter, on_turn, stack
from tests.watching.rods import NARROW, WIDE, jointed_rod, rod_film


@pytest.fixture(scope="module")
def found():
    recorded = rod_film(WIDE)
    return recorded, storyboard(recorded, 12)


@pytest.fixture(scope="module")
def apart():
    recorded = rod_film(NARROW)
    return recorded, storyboard(recorded, 12)


def area(section):
    return section.area()


def test_a_proof_shows_two_parts_that_never_touch_with_start_and_goal_in_different_ones(apart):
    recorded, shots = apart
    parts = shots[-1].parts
    assert all(shot.parts is None for shot in shots[:-1])
    start, goal = recorded.start_of(()), recorded.goal_of(())

    def members(end, part):
        return [
            leaf for leaf, region in part if holds(leaf.intervals, [float(end[2])]) and region.holds(end[:2])
        ]

    assert members(start, parts.reached)
    assert not members(start, parts.others)
    assert members(goal, parts.others)
    assert not members(goal, parts.reached)
    for leaf, region in parts.reached:
        for other, beyond in parts.others:
            neighbours = leaf.slice != other.slice and share_facet(leaf.intervals, other.intervals)
            assert not (neighbours and region.meets(beyond))
    mixed = sum(len(leaf.regions(Kind.MIXED)) for leaf in shots[-1].moment.leaves.values())
    assert len(parts.reached) + len(parts.others) == mixed


def test_the_line_runs_from_start_to_goal_inside_the_cells_of_the_channel(found):
    recorded, shots = found
    shot = shots[-1]
    assert shot.headline.startswith("Found")
    legs, channel = shot.legs, shot.moment.channel
    assert [leg.kind for leg in legs] == [link.kind for link in channel]
    np.testing.assert_array_equal(legs[0].positions[0], recorded.problem.start[:2])
    np.testing.assert_array_equal(legs[-1].positions[-1], recorded.problem.goal_pose[:2])
    assert nearest_turn(legs[-1].angles[-1, 0] - recorded.problem.goal_pose[2]) == pytest.approx(0.0)
    for before, after in pairwise(legs):
        np.testing.assert_array_equal(before.positions[-1], after.positions[0])
        np.testing.assert_allclose(before.angles[-1], after.angles[0], rtol=0, atol=1e-12)
    for leg, link in zip(legs, channel, strict=True):
        # Outlines are straightened by a centimetre before lines are drawn round their corners.
        assert to_polygon(link.region.section).buffer(0.011).covers(LineString(leg.positions))
        for theta in leg.angles[:, 0]:
            assert holds(link.intervals, [theta])


def test_shadows_are_the_unions_of_the_cells_and_do_not_overlap(found):
    _, shots = found
    leaves = list(shots[-1].moment.leaves.values())
    shadow = Shadows().of(leaves)
    for kinds, section in (
        ((Kind.FREE,), shadow.free),
        ((Kind.FREE, Kind.GUIDE), shadow.free + shadow.guide),
        ((Kind.FREE, Kind.GUIDE, Kind.MIXED), shadow.free + shadow.guide + shadow.mixed),
    ):
        exact = union_all(
            [to_polygon(r.section) for leaf in leaves for kind in kinds for r in leaf.regions(kind)]
        )
        assert area(section) == pytest.approx(exact.area, abs=0.01 * exact.length)
    for first, second in combinations((shadow.free, shadow.guide, shadow.mixed), 2):
        assert area(first ^ second) == pytest.approx(0.0, abs=1e-6)


def test_remembered_shadows_are_those_cast_anew(found):
    _, shots = found
    for shot in shots:
        anew = Shadows().of(shot.moment.leaves.values())
        assert area(shot.shadow.free) == area(anew.free)
        assert area(shot.shadow.mixed) == area(anew.mixed)


def test_every_shot_stacks_the_whole_turn_and_the_last_one_its_answer(found, apart):
    for (_, shots), matters in ((found, {Matter.CHANNEL}), (apart, {Matter.REACHED, Matter.OTHERS})):
        slabs = stack(shots)
        last = len(shots) - 1
        assert {slab.matter for slab in slabs if slab.last == last} == matters
        for number in range(last):
            shown = [slab for slab in slabs if slab.first <= number <= slab.last]
            assert {slab.matter for slab in shown} <= {Matter.FREE, Matter.UNDECIDED}
            layers = sorted({slab.theta for slab in shown})
            assert layers[0][0] == pytest.approx(THETA[0])
            assert layers[-1][1] == pytest.approx(THETA[1])
            for below, above in pairwise(layers):
                assert below[1] == above[0]


def test_a_layer_shows_what_some_slice_in_it_knows(found):
    _, shots = found
    number = len(shots) // 2
    leaves = shots[number].moment.leaves.values()
    for slab in stack(shots):
        if slab.matter is not Matter.FREE or not slab.first <= number <= slab.last:
            continue
        met = [
            to_polygon(region.section)
            for leaf in leaves
            for lower, upper in on_turn(leaf.intervals[0])
            if min(upper, slab.theta[1]) - max(lower, slab.theta[0]) > 1e-9
            for region in leaf.regions(Kind.FREE)
        ]
        exact = union_all(met)
        assert area(slab.section) == pytest.approx(exact.area, abs=0.01 * exact.length)


@pytest.mark.parametrize(
    ("interval", "parts"),
    [
        ((0.0, 1.0), [(0.0, 1.0)]),
        ((2 * pi, 2 * pi + 1.0), [(0.0, 1.0)]),
        ((-pi / 4 - 0.5, -pi / 4 + 0.5), [(-pi / 4, -pi / 4 + 0.5), (7 * pi / 4 - 0.5, 7 * pi / 4)]),
        ((-pi, pi), [(-pi / 4, pi), (pi, 7 * pi / 4)]),
    ],
)
def test_intervals_of_theta_are_brought_onto_the_turn_drawn(interval, parts):
    np.testing.assert_allclose(sorted(on_turn(interval)), parts, rtol=0, atol=1e-12)


def test_a_cut_tiles_theta_and_the_joint_without_gap_or_overlap():
    recorded = record(jointed_rod(), Strategy.CELLS, 0.0)
    for shot in storyboard(recorded, 8):
        tiles = cut(shot.moment.leaves.values(), 1, shot.looked_at)
        total = sum((b - a) * (d - c) for (a, b), (c, d) in (leaf.intervals for leaf in tiles))
        assert total == pytest.approx(2 * pi * 2.0)
        strips = cut(shot.moment.leaves.values(), 0, shot.looked_at)
        assert sum(leaf.intervals[0][1] - leaf.intervals[0][0] for leaf in strips) == pytest.approx(2 * pi)


def test_captions_say_what_happens_and_what_a_margin_is_worth(found, apart):
    recorded, shots = found
    splitting = next(shot for shot in shots if shot.moment.splits and shot.moment.verdict is None)
    assert "halved" in splitting.headline
    assert splitting.headline.endswith("along θ")
    assert f"{shots[-1].moment.slices} slices made" in shots[-1].counters
    assert recorded.axis_names == ("θ",)
    assert apart[1][-1].headline.startswith("Infeasible, proved")
    shy = storyboard(rod_film(WIDE, margin=0.06), 3)[-1]
    assert shy.headline.startswith("No way keeps 0.06 m from the walls")
    assert "proved" not in shy.headline


def test_the_papers_algorithms_and_the_whole_portfolio_can_be_watched():
    printed = storyboard(rod_film(WIDE, Strategy.PAPER), 6)
    assert printed[0].moment.slices < printed[-1].moment.slices
    assert printed[-1].moment.verdict in {"found", "below resolution", "budget spent"}
    boxes = storyboard(rod_film(0.6, Strategy.PORTFOLIO, 0.02), 500)
    laying = [shot for shot in boxes if shot.moment.question == BOXES]
    assert len(laying) > 2
    for laid, shot in enumerate(laying):
        assert all(leaf.free_share == 1.0 for leaf in shot.moment.leaves.values())
        line = LineString(np.concatenate([leg.positions for leg in shot.legs] or [np.zeros((2, 2))]))
        free = union_all([to_polygon(link.region.section) for link in shot.moment.channel])
        assert laid == 0 or free.buffer(0.011).covers(line)
    assert boxes[-1].headline.startswith("Found")
    assert all(link.kind is Kind.FREE for link in boxes[-1].moment.channel)
    refuted = storyboard(rod_film(NARROW, Strategy.PORTFOLIO, 0.02), 6)
    assert refuted[-1].moment.verdict == "infeasible"


def test_the_same_question_gives_the_same_storyboard(found):
    _, shots = found
    again = storyboard(rod_film(WIDE), 12)
    for first, second in zip(shots, again, strict=True):
        assert (first.headline, first.counters) == (second.headline, second.counters)
        assert first.moment.leaves.keys() == second.moment.leaves.keys()
        for leg, other in zip(first.legs, second.legs, strict=True):
            np.testing.assert_array_equal(leg.positions, other.positions)
            np.testing.assert_array_equal(leg.angles, other.angles)
    for slab, other in zip(stack(shots), stack(again), strict=True):
        assert (slab.matter, slab.theta, slab.first, slab.last) == (
            other.matter,
            other.theta,
            other.first,
            other.last,
        )
        assert [ring.tolist() for ring in slab.section.to_polygons()] == [
            ring.tolist() for ring in other.section.to_polygons()
        ]
