"""Questions whose answer is known to be yes: a floor carved along a path that the team surely follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from hypothesis import assume
from hypothesis import strategies as st
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.sampling.collision import densified
from coop_drake.tree.component_tree import ComponentTree, configuration_scale
from tests.support.free_positions import FreePositions
from tests.support.trees import placed_shape, trees

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
    path = densified(_corners(tree, random, draw(st.integers(2, 3))), configuration_scale(tree), _STEP)
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


def _corners(tree: ComponentTree, random: np.random.Generator, legs: int) -> np.ndarray:
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


def _pieces(tree: ComponentTree, path: np.ndarray) -> list[BaseGeometry]:
    """Every convex piece at every configuration of a path."""
    return [
        placed_shape(shape, X_WC, quad_segs=8)
        for z in path
        for component, X_WC in zip(tree.components, tree.poses(z), strict=True)
        for body in component.bodies
        for shape in body.shapes
    ]
