"""No answer contradicts what is known exactly: widths, rigid bodies, planted paths, moved scenes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Point, Polygon
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.cells.graph import Kind
from coop_drake.planning.channel import Channel
from coop_drake.planning.proofs import blocked_goal
from coop_drake.planning.questions import relaxed
from coop_drake.planning.sampling.collision import densified
from coop_drake.planning.search import find_channel
from coop_drake.plant.chain import planar_pose
from coop_drake.tree import component_tree
from coop_drake.verification.answer import same_angle
from tests.support.cases import case
from tests.support.free_positions import FreePositions, wall_edges
from tests.support.moved import Similarity
from tests.support.passages import DiscDoor, FoldingArm, LadderCorner, RodCorridor
from tests.support.shapes import floors
from tests.support.soundness import assert_channel_is_sound
from tests.support.trees import placed_shape, trees

PASSAGES = (DiscDoor(), RodCorridor(), LadderCorner(), FoldingArm())
NAMES = [type(passage).__name__ for passage in PASSAGES]
EPS = 0.003
"""With the settings that a user gets, no width further than this from the critical one is undecided [m]."""


@pytest.mark.slow
@pytest.mark.parametrize("passage", PASSAGES, ids=NAMES)
def test_just_above_the_critical_width_a_channel_is_found(passage) -> None:
    problem = passage.problem(passage.critical + EPS)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel, samples=12)


@pytest.mark.slow
@pytest.mark.parametrize("passage", PASSAGES, ids=NAMES)
def test_just_below_the_critical_width_the_answer_is_a_proof(passage) -> None:
    answer, _ = find_channel(passage.problem(passage.critical - EPS))
    assert not isinstance(answer, Channel)
    assert answer.proved


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 1e-4])
@pytest.mark.parametrize("passage", PASSAGES[:3], ids=NAMES[:3])
def test_near_the_critical_width_no_answer_is_wrong(passage, offset: float) -> None:
    """A body as wide as its passage touches the walls all along: at the critical width itself, no."""
    problem = passage.problem(passage.critical + offset, PlannerSettings(max_slices=64))
    answer, _ = find_channel(problem)
    if isinstance(answer, Channel):
        assert offset > 0.0
        assert_channel_is_sound(problem, answer, samples=12)
    else:
        assert offset <= 0.0 or not answer.proved


SHIFTS = st.sampled_from((0.0, 1e4, -12345.678, 0.1))
SIMILARITIES = st.builds(
    Similarity,
    angle=st.one_of(st.sampled_from((0.0, 0.5 * np.pi, np.pi)), st.floats(-7.0, 7.0)),
    shift=st.tuples(SHIFTS, SHIFTS),
    mirror=st.booleans(),
    scale=st.sampled_from((1.0, 0.1, 10.0, 1000.0)),
)


@pytest.mark.slow
@settings(max_examples=9)
@given(st.sampled_from(PASSAGES), st.sampled_from((0.02, -0.02)), SIMILARITIES)
def test_a_passage_is_passed_or_blocked_wherever_it_stands(
    passage, offset: float, similarity: Similarity
) -> None:
    answer, _ = find_channel(similarity.question(passage.problem(passage.critical + offset)))
    if offset > 0.0:
        assert isinstance(answer, Channel)
    else:
        assert not isinstance(answer, Channel)
        assert answer.proved


@settings(max_examples=4)
@given(st.sampled_from(PASSAGES), st.sampled_from((0.02, -0.02)), st.integers(-3, 3), st.integers(-3, 3))
def test_whole_turns_of_start_and_goal_change_no_answer(
    passage, offset: float, first: int, last: int
) -> None:
    problem = passage.problem(passage.critical + offset)
    turned = replace(
        problem,
        start=problem.start + 2.0 * np.pi * first * (np.arange(len(problem.start)) == 2),
        goal_pose=problem.goal_pose + np.array([0.0, 0.0, 2.0 * np.pi * last]),
    )
    answer, _ = find_channel(turned)
    assert isinstance(answer, Channel) == (offset > 0.0)
    if isinstance(answer, Channel):
        assert same_angle(answer.goal_angle, problem.goal_pose[2])
        assert answer.boxes[0].lower[0] <= turned.start[2] <= answer.boxes[0].upper[0]
    else:
        assert answer.proved


@given(st.floats(-100.0, 100.0), st.integers(-9, 9))
def test_every_part_takes_angles_apart_by_whole_turns_for_one(angle: float, turns: int) -> None:
    turned = angle + 2.0 * np.pi * turns
    assert same_angle(angle, turned)
    assert same_angle(component_tree.nearest_turn(turned), angle)
    assert component_tree.nearest_turn(turned - angle) == pytest.approx(0.0, abs=1e-12)
    assert same_angle(
        planar_pose(RigidTransform(RotationMatrix.MakeZRotation(turned), np.zeros(3))).angle, angle
    )


def is_joined(
    floor: Polygon, body: Polygon, start: np.ndarray, goal: np.ndarray, layers: int, hair: float
) -> bool:
    """Whether layers of free positions join two poses (x, y, theta).

    Args:
        floor: W.
        body: A convex body in its own frame, about the origin that its pose is measured at.
        start: First pose, shape (3,).
        goal: Last pose, shape (3,).
        layers: How many angles of a whole turn.
        hair: How much to grow the body at each of them, negative to shrink it [m].
    """
    angles = 2.0 * np.pi * np.arange(layers) / layers
    parts = [list(shapely.get_parts(_free(floor, body, angle, hair))) for angle in angles]
    first = np.concatenate(([0], np.cumsum([len(part) for part in parts])))
    edges = [
        (first[i] + a, first[(i + 1) % layers] + b)
        for i in range(layers)
        for a, one in enumerate(parts[i])
        for b, other in enumerate(parts[(i + 1) % layers])
        if one.intersects(other)
    ]
    rows, columns = np.array(edges, dtype=int).reshape(-1, 2).T
    size = int(first[-1])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    labels = connected_components(graph, directed=False)[1] if size else np.zeros(0, dtype=int)

    def touched(pose: np.ndarray) -> set[int]:
        layer = int(np.rint(pose[2] / (2.0 * np.pi) * layers)) % layers
        here = Point(pose[:2])
        return {int(labels[first[layer] + k]) for k, part in enumerate(parts[layer]) if part.intersects(here)}

    return bool(touched(start) & touched(goal))


def _free(floor: Polygon, body: Polygon, angle: float, hair: float) -> shapely.Geometry:
    """Positions at which the body fits, grown by a hair."""
    turned = rotate(body, angle, origin=(0.0, 0.0), use_radians=True).buffer(hair, join_style="mitre")
    if turned.is_empty:
        return floor
    vertices = shapely.get_coordinates(turned)[:-1]
    corners = (wall_edges(floor)[:, :, None, :] - vertices).reshape(-1, 2 * len(vertices), 2)
    walls = shapely.union_all(shapely.convex_hull(shapely.linestrings(corners)))
    return shapely.affinity.translate(floor, *-vertices[0]).difference(walls)


LAYERS = 60


@pytest.mark.slow
@settings(max_examples=8, suppress_health_check=list(HealthCheck))
@given(floors(), st.integers(0, 1_000_000))
def test_no_answer_contradicts_the_exact_one(floor: Polygon, seed: int) -> None:
    random = np.random.default_rng(seed)
    length, breadth = random.uniform(0.3, 1.3), random.uniform(0.05, 0.4)
    corners = np.array([[-length, -breadth], [length, -breadth], [length, breadth], [-length, breadth]]) / 2
    ring = (corners + random.uniform(-0.3, 0.3, 2))[: random.integers(3, 5)]
    body = component_tree.Body("object", None, (component_tree.ConvexShape(ring),))
    tree = component_tree.ComponentTree(
        (component_tree.Component("object", None, None, (body,)),), frozenset()
    )
    start, goal = (free_pose(tree, floor, random) for _ in range(2))
    few = PlannerSettings(max_slices=300)
    answer, _ = find_channel(PlanningProblem(floor, tree, start, goal, (), settings=few))
    hair = float(np.hypot(*ring.T).max()) * np.pi / LAYERS
    if isinstance(answer, Channel):
        assert is_joined(floor, Polygon(ring), start, goal, LAYERS, -hair)
    elif answer.proved:
        assert not is_joined(floor, Polygon(ring), start, goal, LAYERS, hair)


def free_pose(tree: component_tree.ComponentTree, floor: Polygon, random: np.random.Generator) -> np.ndarray:
    for _ in range(50):
        angle = random.uniform(-np.pi, np.pi)
        places = random.uniform(floor.bounds[:2], floor.bounds[2:], (20, 2))
        free = places[FreePositions(tree, floor, (angle,)).free(places)]
        if len(free):
            return np.array([*free[0], angle])
    assume(False)
    raise AssertionError


_STEP = 0.04


@dataclass(frozen=True)
class Planted:
    """A question and configurations on a way that answers it, start and goal too, shape (m, 3 + n)."""

    problem: PlanningProblem
    path: np.ndarray


@st.composite
def planted(draw: st.DrawFn, robots: tuple[int, int] = (1, 3), joints: tuple[int, int] = (1, 2)) -> Planted:
    """A random team, a random path of two or three legs, and the floor that it needs, little more."""
    tree = draw(trees(robots, joints))
    random = np.random.default_rng(draw(st.integers(0, 1_000_000)))
    room = draw(st.sampled_from((0.03, 0.06, 0.15)))
    path = densified(
        _stops(tree, random, draw(st.integers(2, 3))), component_tree.configuration_scale(tree), _STEP
    )
    floor = shapely.union_all(_pieces(tree, path)).buffer(room, quad_segs=2)
    floor = floor.simplify(0.4 * room)
    assume(isinstance(floor, Polygon))
    assert isinstance(floor, Polygon)
    path = np.concatenate((path[:-1:3], path[-1:]))
    assume(all(FreePositions(tree, floor, z[2:]).free(z[None, :2])[0] for z in path))
    fixed = random.random(len(tree.joints)) < 0.5
    goal = path[-1]
    problem = PlanningProblem(
        workspace=floor,
        tree=tree,
        start=path[0],
        goal_pose=goal[:3],
        goal_joints=tuple(float(q) if keep else None for q, keep in zip(goal[3:], fixed, strict=True)),
        settings=PlannerSettings(margin=0.02, max_slices=300),
    )
    return Planted(problem, path)


def _stops(tree: component_tree.ComponentTree, random: np.random.Generator, legs: int) -> np.ndarray:
    """Configurations without self-collision, each some way from the one before, shape (legs + 1, 3 + n)."""
    lower, upper = tree.range_lower, tree.range_upper
    start = np.concatenate((np.zeros(2), random.uniform(-np.pi, np.pi, 1), 0.5 * (lower + upper)))
    corners = [start]
    for _ in range(legs):
        z = corners[-1].copy()
        turn = random.uniform(-np.pi, np.pi)
        z[:2] += random.uniform(0.3, 1.5) * np.array([np.cos(turn), np.sin(turn)])
        z[2] += random.uniform(-1.5, 1.5)
        turned = z[3:] + random.uniform(-0.5, 0.5, len(lower)) * (upper - lower)
        z[3:] = np.clip(turned, tree.joint_lower, tree.joint_upper)
        corners.append(z)
    return np.array(corners)


def _pieces(tree: component_tree.ComponentTree, path: np.ndarray) -> list[BaseGeometry]:
    """Every convex piece at every configuration of a path."""
    return [
        placed_shape(shape, X_WC, quad_segs=8)
        for z in path
        for component, X_WC in zip(tree.components, tree.poses(z), strict=True)
        for body in component.bodies
        for shape in body.shapes
    ]


SLICES = 16


@pytest.mark.slow
@settings(max_examples=6, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
@given(planted(robots=(1, 2)))
def test_a_path_known_to_be_free_lies_in_the_over_cells_of_all_relaxations(plant: Planted) -> None:
    assert blocked_goal(plant.problem)[0] is None
    assert_no_relaxation_loses(plant.problem, plant.path)


@pytest.mark.parametrize("name", ["base"])
def test_a_certified_path_lies_in_the_over_cells_of_all_relaxations(name: str) -> None:
    problem = case(name, PlannerSettings(margin=0.0))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.path is not None
    assert_no_relaxation_loses(problem, channel.path)


def assert_no_relaxation_loses(problem: PlanningProblem, path: np.ndarray) -> None:
    robots = sorted({joint.robot for joint in problem.tree.joints})
    for chosen in [some for count in range(len(robots) + 1) for some in combinations(robots, count)]:
        question, joints = relaxed(problem, chosen)
        exploration = Exploration(question)
        assert exploration.run(SLICES).verdict is not Verdict.INFEASIBLE
        axes = [2, *[3 + joint for joint in joints]]
        assert all(is_covered(exploration, z[:2], z[axes]) for z in path)


def is_covered(exploration: Exploration, position: np.ndarray, angles: np.ndarray) -> bool:
    """Whether every leaf that holds the angles has an over-cell that holds the position."""
    leaves = exploration.slices.holding([float(angle) for angle in angles])
    return bool(leaves) and all(
        any(
            cell.region.holds(position)
            for cell in exploration.graph.by_slice[leaf]
            if cell.kind is Kind.MIXED
        )
        for leaf in leaves
    )
