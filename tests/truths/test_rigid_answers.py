"""Answers for rigid bodies on ragged floors agree with an exact roadmap through layers of theta."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from shapely import Polygon

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.channel import Channel
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape
from tests.support.free_positions import FreePositions
from tests.support.layers import is_joined
from tests.support.shapes import floors

LAYERS = 60


@pytest.mark.slow
@settings(max_examples=8, suppress_health_check=list(HealthCheck))
@given(floors(), st.integers(0, 1_000_000))
def test_no_answer_contradicts_the_exact_one(floor: Polygon, seed: int) -> None:
    random = np.random.default_rng(seed)
    length, breadth = random.uniform(0.3, 1.3), random.uniform(0.05, 0.4)
    corners = np.array([[-length, -breadth], [length, -breadth], [length, breadth], [-length, breadth]]) / 2
    ring = (corners + random.uniform(-0.3, 0.3, 2))[: random.integers(3, 5)]
    body = Body("object", None, (ConvexShape(ring),))
    tree = ComponentTree((Component("object", None, None, (body,)),), frozenset())
    start, goal = (free_pose(tree, floor, random) for _ in range(2))
    settings = PlannerSettings(max_slices=300)
    answer, _ = find_channel(PlanningProblem(floor, tree, start, goal, (), settings=settings))
    hair = float(np.hypot(*ring.T).max()) * np.pi / LAYERS
    if isinstance(answer, Channel):
        assert is_joined(floor, Polygon(ring), start, goal, LAYERS, -hair)
    elif answer.proved:
        assert not is_joined(floor, Polygon(ring), start, goal, LAYERS, hair)


def free_pose(tree: ComponentTree, floor: Polygon, random: np.random.Generator) -> np.ndarray:
    for _ in range(50):
        angle = random.uniform(-np.pi, np.pi)
        places = random.uniform(floor.bounds[:2], floor.bounds[2:], (20, 2))
        free = places[FreePositions(tree, floor, (angle,)).free(places)]
        if len(free):
            return np.array([*free[0], angle])
    assume(False)
    raise AssertionError
