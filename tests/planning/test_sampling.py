"""Paths that are sampled: trees, clearances, narrow passages, routes, and boxes along them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Point, Polygon, box

from benchmarks.planner.family import corridor_problem, crowd_problem, shelf_problem
from coop_drake.answers import Found, PlannerSettings
from coop_drake.answers.document import problem_digest
from coop_drake.errors import GeometryError, PlanError
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.sweeps import over_piece
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.laws import ScheduledGains
from coop_drake.planning.boxes import (
    PairSweeps,
    box_arrays,
    clearances_in_box,
    sweeps_apart,
    swept_piece,
)
from coop_drake.planning.cells.cells import CellMaker
from coop_drake.planning.channel import Channel, Regions, middle_of
from coop_drake.planning.planner import plan
from coop_drake.planning.questions import exact_footprint, marginal_workspace, nearby
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.band import (
    clearances,
    estimated_duration,
    kept_margin,
    moved_from_obstacles,
    path_clearance,
)
from coop_drake.planning.sampling.collision import (
    ALL,
    FAR,
    grid_for_team,
    grid_inside,
    is_free,
    lay_grid,
    ring_clearance,
    team_clearance,
)
from coop_drake.planning.sampling.narrow_passages import (
    MITRE_LIMIT,
    are_free,
    body_contacts,
    centred,
    repaired,
    widened_floor,
)
from coop_drake.planning.sampling.routes import MANY_CORNERS, disc_route, local_question
from coop_drake.planning.sampling.sampler import Sampler, SubsystemHierarchy
from coop_drake.planning.sampling.trees import SampledRegion, add, draw, empty_tree, nearest
from coop_drake.planning.search import find_channel, find_path
from coop_drake.tree.component_tree import place, team_arrays
from coop_drake.verification import verify_plan
from tests.planning.test_search import rod_problem
from tests.support.cases import case, transport, warehouse
from tests.support.free_positions import FreePositions
from tests.support.soundness import no_channel, sound_channel
from tests.support.trees import body_footprints, configurations, footprint, room, slices_of, trees

# The grid of a random tree finds the nearest node, as comparing with all nodes does.

LOWER, UPPER = np.array([-1.0, 2.0, -np.pi, -1.5]), np.array([9.0, 6.0, np.pi, 1.5])


@pytest.mark.parametrize("circles", [[2], [2, 3]], ids=["joint with limits", "joint without limits"])
@pytest.mark.parametrize("spread", [0.05, 1.0], ids=["crowded", "all over the floor"])
def test_the_nearest_node_is_found(spread, circles):
    random = np.random.default_rng(3)
    scale = np.array([1.0, 1.0, 1.3, 0.4])
    middle, size = 0.5 * (LOWER + UPPER), 1.2 * (UPPER - LOWER)  # Some nodes are beyond the floor.
    nodes = middle + spread * (random.random((400, 4)) - 0.5) * size
    nodes[:, circles] *= 3.0  # Circular axes are not limited to one turn.
    tree = empty_tree(len(nodes), LOWER, UPPER, np.isin(np.arange(4), circles))
    for k, z in enumerate(nodes):
        add(tree, k, z, -1)
        sample = middle + 1.3 * (random.random(4) - 0.5) * size
        d = sample - nodes[: k + 1]
        d[:, circles] -= 2.0 * np.pi * np.round(d[:, circles] / (2.0 * np.pi))
        assert nearest(tree, sample, scale) == np.argmin(((d * scale) ** 2).sum(axis=1))


# Samples around a guide: component by component they are free far more often, and stay within the region.

SAMPLES = 400


@pytest.fixture(scope="module")
def crowd():
    return crowd_problem(4)


def test_samples_of_a_large_team_are_free_more_often_component_by_component(crowd):
    team = team_arrays(crowd.tree)
    grid = grid_for_team(crowd.workspace, team)
    lower = np.array([0.0, 0.0, -np.pi, *crowd.tree.joint_lower])
    upper = np.array([14.0, 20.0, np.pi, *crowd.tree.joint_upper])
    circular = np.array([False, False, *crowd.tree.circular])
    spread = np.array([0.3, 0.3, *[0.0] * (len(lower) - 2)])
    guide = crowd.start[None, :].astype(float)
    uniforms = np.random.default_rng(3).random((SAMPLES, 2 + len(lower)))
    free = {}
    for tries in (1, 12):
        region = SampledRegion(guide, spread, lower, upper, circular, 0, tries)
        samples, poses = np.empty((SAMPLES, len(lower))), np.empty((len(team.links), 5))
        for u, sample in zip(uniforms, samples, strict=True):
            draw(team, grid, region, u, 0, 0.0, sample, poses)
        assert (samples >= lower).all()
        assert (samples <= upper).all()
        free[tries] = sum(is_free(team, grid, z, 0.0) for z in samples)
    assert free[12] > 0.95 * SAMPLES > free[1]


@pytest.mark.parametrize("part", [None, (1,)])
def test_the_path_for_the_whole_team_or_a_part_of_it_first_is_free_and_repeats(crowd, part):
    def path():
        workspace = marginal_workspace(crowd, 0.015)
        return Sampler(SubsystemHierarchy(crowd), workspace, 0.01, 0).direct_path(4_000, part)

    found = path()
    assert np.array_equal(found[0], crowd.start)
    assert np.array_equal(found[-1, :2], crowd.goal_pose[:2])
    assert are_free(crowd, found).all()
    assert np.array_equal(found, path())


def test_a_path_begins_where_bodies_are_nearer_to_each_other_than_paths_keep(crowd):
    team, workspace = team_arrays(crowd.tree), marginal_workspace(crowd, 0.015)
    grid, random = grid_for_team(workspace, team), np.random.default_rng(5)
    lower, upper = crowd.tree.joint_lower, crowd.tree.joint_upper
    drawn = (np.array([*crowd.start[:3], *random.uniform(lower, upper)]) for _ in range(10_000))
    near = next(z for z in drawn if is_free(team, grid, z, 0.002) and not is_free(team, grid, z, 0.009))
    close = replace(crowd, start=near)
    hierarchy = SubsystemHierarchy(close)
    assert 0.001 < hierarchy.gap_at_ends(0.01) < 0.01 == SubsystemHierarchy(crowd).gap_at_ends(0.01)
    found = Sampler(hierarchy, workspace, 0.01, 0).direct_path(4_000)
    assert np.array_equal(found[0], near)
    assert are_free(close, found).all()
    given = replace(close, start=crowd.start, goal_joints=tuple(near[3:]))
    assert SubsystemHierarchy(given).gap_at_ends(0.01) == hierarchy.gap_at_ends(0.01)


def test_a_path_is_sampled_around_the_channel_of_an_exploration():
    crowd = corridor_problem(1.2)
    crowd = replace(crowd, settings=PlannerSettings(strategy="cells", margin=0.0))
    channel, _ = find_channel(crowd)
    assert isinstance(channel, Channel)
    guide = middle_of(channel, crowd.start)
    assert len(guide) == len(channel.boxes)
    assert are_free(crowd, guide).all()
    found = SampledSearch(crowd).around(guide)
    assert found is not None
    assert np.array_equal(found.path[[0, -1], :2], [crowd.start[:2], crowd.goal_pose[:2]])
    assert are_free(crowd, found.path).all()


# The grid over a floor: every square lists all edges near it, nearest first, and knows whether it is inside.

FLOORS = {
    "room": room(),
    "warehouse": warehouse(),
    "two": MultiPolygon([box(0, 0, 2, 1), Polygon(box(3, 0, 6, 3).exterior, [box(4, 1, 5, 2).exterior])]),
    "far away": shapely.transform(room(), lambda points: points + np.array([1e4, -2e4])),
}


@pytest.mark.parametrize("name", FLOORS)
def test_a_point_is_as_far_from_the_walls_as_it_is_up_to_the_grid_s_reach(name: str) -> None:
    floor, reach, here = FLOORS[name], 0.3, np.zeros((1, 2))
    grid, (x_min, y_min, x_max, y_max) = lay_grid(polygon_rings(floor), reach), floor.bounds
    points = np.random.default_rng(5).uniform(
        (x_min - 0.5, y_min - 0.5), (x_max + 0.5, y_max + 0.5), (600, 2)
    )
    away = np.minimum(shapely.distance(floor.boundary, shapely.points(points)), reach)
    found = [
        ring_clearance(grid, here, 0, 1, 0.0, np.zeros(3), x, y, 1.0, 0.0, np.inf) for x, y in points.tolist()
    ]
    inside = shapely.contains_xy(floor, points)
    np.testing.assert_allclose(found, np.where(inside, away, -1.0), atol=1e-7)
    assert (away[inside] == reach).any()


@pytest.mark.parametrize("reach", [0.2, 1.5])
def test_the_floor_near_a_way_is_all_that_a_team_can_touch(reach: float) -> None:
    floor = warehouse()
    way = np.array([[0.9, 2.0], [0.9, 3.4], [1.1, 5.0]])
    near = nearby(floor, way, reach)
    touched = LineString(way).buffer(reach)
    assert near.intersection(touched).symmetric_difference(floor.intersection(touched)).area < 1e-9
    assert near.difference(floor).area < 1e-9
    assert near.area < floor.area


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
        found = team_clearance(team_arrays(tree), grid, place(team_arrays(tree), z), 0.5, ALL)
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
    # Sweeps reach a little further than the team, and clearances are known within the reach of the grid.
    boxes, grid = box_arrays(swept.tree), grid_inside(room(), 2.0 * tree.reach)
    bounds = np.array(intervals)

    def clearance(position: np.ndarray) -> float:
        lower, upper = bounds.T.copy()
        found = clearances_in_box(boxes, grid, lower, upper, position, 0, 0, FAR)
        return found[0] if len(found) else -1.0

    regions = CellMaker(swept, room()).under_cells(intervals)
    for region in regions:
        middle = region.rings[0].mean(axis=0, keepdims=True)
        depth = max(float(other.depths(middle)[0]) for other in regions)
        found = min(clearance(middle), FAR)
        assert found == pytest.approx(min(depth, FAR), abs=1e-5) if depth > 0.0 else found < 1e-4
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
    boxes, bounds = box_arrays(swept.tree), np.array(intervals)
    lower, upper = bounds[:, 0].copy(), bounds[:, 1].copy()
    count = len(boxes.pair_sweeps)
    sweeps = PairSweeps(np.zeros(count + 1, np.int64), np.zeros(count))
    vertices, row = np.empty((1, 2)), 0
    for piece in reversed(range(len(swept.pieces))):
        ring, vertices, row = swept_piece(boxes, piece, lower, upper, sweeps, vertices, row)
        assert (ring == over_piece(boxes.team, piece, lower, upper, len(boxes.team.links), True)).all()
    assert row == len(boxes.pair_sweeps)
    for k, (piece, stages) in enumerate(boxes.pair_sweeps.tolist()):
        kept = vertices[sweeps.first[k] : sweeps.first[k + 1]]
        assert (kept == over_piece(boxes.team, piece, lower, upper, stages, False)).all()
    assert sweeps_apart(boxes, sweeps, vertices) == (swept.pairs.touching(intervals) is None)


# Paths with clearance: moved from the walls, measured as shapely measures them, and covered on request.


@pytest.fixture(scope="module")
def problem():
    return rod_problem(0.6)


@pytest.fixture(scope="module")
def bent():
    """A path for the rod that turns late and passes close to a wall of the corridor."""
    y = 0.5 * 0.6 - 0.1 - 0.02
    return np.array(
        [[-2.5, 0, 1.5], [-1.7, y, 0.0], [1.7, y, 0.0], [2.5, 0, 1.5]],
        dtype=float,
    )


def clearance(problem, path):
    """Least distance of the exact footprint from the walls at many places of a path [m]."""
    places = np.linspace(0.0, len(path) - 1.0, 400)
    samples = np.array([np.interp(places, np.arange(len(path)), column) for column in path.T]).T
    walls = problem.workspace.boundary
    return min(walls.distance(exact_footprint(problem.tree, z)) for z in samples)


def test_the_clearance_is_what_shapely_measures(problem, bent):
    assert path_clearance(problem, bent, 1.0) == pytest.approx(clearance(problem, bent), abs=2e-3)
    assert path_clearance(problem, bent, 0.01) == 0.01


def test_a_path_is_moved_from_the_walls_and_stays_free(problem, bent):
    wide = moved_from_obstacles(problem, bent)
    np.testing.assert_array_equal(wide[[0, -1]], bent[[0, -1]])
    assert clearance(problem, wide) > 3.0 * clearance(problem, bent)
    assert estimated_duration(problem, wide) < estimated_duration(problem, bent)
    for z in wide:
        assert FreePositions(problem.tree, problem.workspace, z[2:]).free(z[None, :2]).all()


def test_a_margin_keeps_to_the_paths_clearance_and_to_what_is_asked(problem, bent):
    wide = moved_from_obstacles(problem, bent)
    assert 0.0 < kept_margin(problem, wide) <= problem.settings.margin
    assert kept_margin(problem, wide) < path_clearance(problem, wide, 1.0)
    least = replace(problem, settings=replace(problem.settings, margin=0.01))
    assert kept_margin(least, wide) == 0.01
    unasked = replace(problem, settings=replace(problem.settings, margin=0.0))
    assert kept_margin(unasked, wide) == 0.0


def test_polygons_that_cannot_be_made_are_no_channel_and_no_proof(problem, monkeypatch):
    monkeypatch.setattr(Regions, "around", lambda self, box: None)
    path, _ = find_path(problem)
    with pytest.raises(GeometryError, match="cannot be computed"):
        path.channel()
    no_channel(problem, proved=False)


# Paths for a larger floor, repaired until they fit the original floor.

THROUGH = np.array([[-2.5, 0.0, 1.5], [-2.5, 0.0, 0.0], [2.5, 0.0, 0.0], [2.5, 0.0, 1.5]])


def tilted(angle: float = 0.05) -> np.ndarray:
    """A path of the rod through the corridor that holds it at an angle inside."""
    paths = THROUGH.copy()
    paths[1:3, 2] = angle
    return np.concatenate([a + (b - a) * np.linspace(0, 1, 41)[:, None] for a, b in pairwise(paths)])


@pytest.mark.parametrize(("corridor", "fits"), [(0.21, True), (0.19, False)])
def test_a_path_is_repaired_only_where_it_fits(corridor, fits):
    problem = rod_problem(corridor)
    path, short = repaired(problem, tilted(), 0.06)
    assert (short <= 0.0) == fits
    assert are_free(problem, path).all() == fits


def test_a_widened_floor_has_its_walls_moved_back_and_loses_thin_ones():
    thick, thin = box(1.0, 1.0, 1.3, 2.0), box(2.0, 1.0, 2.15, 2.0)
    found = widened_floor(box(0.0, 0.0, 4.0, 3.0).difference(thick | thin), 0.1)
    wanted = box(-0.1, -0.1, 4.1, 3.1).difference(box(1.1, 1.1, 1.2, 1.9))
    assert isinstance(found, MultiPolygon)
    assert found.symmetric_difference(wanted).area == pytest.approx(0.0, abs=1e-12)
    corner = widened_floor(Polygon([(0, 0), (8, 0), (0, 0.2)]), 0.1)  # Its mitre would be 8 m long.
    assert corner.contains(box(0.0, 0.0, 0.1, 0.1))
    assert corner.bounds[2] < 8.0 + 0.1 * (1.0 + MITRE_LIMIT)


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_corridor_too_narrow_for_samples_is_found_and_sound():
    problem = transport(0.79)
    sound_channel(problem)


# Paths moved to the middle of their narrowest passages, and the distances that this is computed from.


def poses_near_walls(problem, count=40):
    """Free configurations of a team that are up to 0.1 m from a wall."""
    team, random = team_arrays(problem.tree), np.random.default_rng(3)
    low, high = problem.workspace.bounds[:2], problem.workspace.bounds[2:]
    joints = problem.tree.joint_lower, problem.tree.joint_upper
    drawn = random.uniform([*low, -3.0, *joints[0]], [*high, 3.0, *joints[1]], (40_000, 3 + len(joints[0])))
    clear = clearances(team, grid_for_team(problem.workspace, team), drawn, 0.2)
    near = drawn[(clear > 1e-3) & (clear < 0.1)]
    return near[are_free(problem, near)][:count]


def test_the_nearest_contact_of_bodies_is_their_distance():
    problem = case("elbow")
    team, path = team_arrays(problem.tree), poses_near_walls(problem, 10)
    found = body_contacts(team, path, 5.0)
    for k, z in enumerate(path):
        bodies = body_footprints(problem.tree, z)
        apart = min(bodies[a].distance(bodies[b]) for a, b in problem.tree.collision_pairs)
        assert found.distances[found.rows == k].min() == pytest.approx(apart, abs=2e-3)  # Discs are polygons.


@pytest.mark.parametrize("corridor", [0.2016, 0.199])
def test_a_path_is_moved_to_the_middle_of_its_passage(corridor):
    problem = rod_problem(corridor)
    path, short = centred(problem, tilted(0.002), 0.002)
    assert short == pytest.approx(0.5 * (0.2 - corridor), abs=1e-5)
    easier = problem.workspace.buffer(short + 1e-9, join_style="mitre")
    assert are_free(replace(problem, workspace=easier), path).all()
    assert np.array_equal(path[[0, -1]], tilted()[[0, -1]])


# On large floors plans are looked for near a short route; they answer the question on the whole floor.

BEND = Polygon([(0, 0), (8, 0), (8, 1), (1, 1), (1, 7), (0, 7)])
"""Two aisles of 1 m that meet at a right angle."""


@pytest.mark.parametrize("radius", [0.1, 0.3, 0.45])
def test_a_route_keeps_the_disc_inside(radius: float) -> None:
    start, goal = np.array([7.5, 0.5]), np.array([0.5, 6.5])
    route = disc_route(BEND, start, goal, radius)
    assert (route[0] == start).all()
    assert (route[-1] == goal).all()
    line = LineString(route)
    assert BEND.contains(line)
    assert BEND.boundary.distance(line) > 0.7 * radius  # the disc's radius, but for half a square
    assert line.length < 14.0


def test_there_is_no_route_through_a_gap_that_is_too_narrow_or_from_outside() -> None:
    floor = Polygon(box(0, 0, 6, 2).exterior, [box(2.8, 0.1, 3.2, 1.8).exterior])
    assert len(disc_route(floor, np.array([1.0, 1.0]), np.array([5.0, 1.0]), 0.15)) == 0
    assert len(disc_route(floor, np.array([1.0, 1.0]), np.array([5.0, 1.0]), 0.08)) > 1
    assert len(disc_route(floor, np.array([9.0, 1.0]), np.array([5.0, 1.0]), 0.08)) == 0


def test_a_route_prefers_the_wide_passage_and_few_turns() -> None:
    floor = Polygon(box(0, 0, 9, 6).exterior, [box(4, 0.5, 5, 3.5).exterior])
    route = disc_route(floor, np.array([1.0, 2.2]), np.array([8.0, 2.2]), 0.2)
    assert LineString(route).intersects(box(4, 3.5, 5, 6))
    rows = shelf_problem(200)
    across = disc_route(rows.workspace, rows.start[:2], rows.goal_pose[:2], 0.2)
    assert len(across) <= 8


def test_a_plan_near_a_route_answers_the_question_on_the_whole_floor() -> None:
    far = shelf_problem(MANY_CORNERS + 200)
    question = replace(far, goal_pose=far.start[:3] + np.array([9.0, 0.0, 0.0]))  # three aisles further
    near = local_question(question)
    assert near is not None
    local, route = near
    assert local.workspace.contains(LineString(route))
    assert question.workspace.buffer(1e-9).contains(local.workspace)
    assert shapely.get_num_coordinates(local.workspace) < MANY_CORNERS / 2
    assert all(local.workspace.contains(Point(p[:2])) for p in (question.start, question.goal_pose))
    gains = ScheduledGains()
    result = plan(question, gains, gain_set_name="scheduled")
    assert isinstance(result, Found)
    verify_plan(result.plan, question, {"scheduled": gains})  # raises an error where it refuses
    assert result.plan.problem == problem_digest(question) != problem_digest(local)


def test_small_floors_and_floors_without_a_route_are_searched_whole() -> None:
    assert local_question(corridor_problem()) is None
    question = shelf_problem(MANY_CORNERS + 200)
    x_min, _, x_max, y_max = question.workspace.bounds
    wall = box(x_min - 1.0, 0.5 * y_max, x_max + 1.0, 0.5 * y_max + 0.2)
    parted = question.workspace.difference(wall)
    lower = max(parted.geoms, key=lambda part: -part.bounds[1])
    assert local_question(replace(question, workspace=Polygon(lower.exterior, lower.interiors))) is None


def test_a_large_question_without_meaning_is_refused() -> None:
    question = shelf_problem(MANY_CORNERS + 200)
    with pytest.raises(PlanError, match="goal_pose"):
        local_question(replace(question, goal_pose=np.array([np.nan, 0.0, 0.0])))
