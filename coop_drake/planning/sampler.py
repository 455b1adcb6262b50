"""Candidate paths by sampling, robots added one by one: the arm ladder."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from shapely import MultiPolygon

from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.collision_kernels import is_free
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.refine import configuration_scale
from coop_drake.planning.relaxation import relaxed
from coop_drake.planning.team_arrays import team_arrays
from coop_drake.planning.tree_kernels import chain_is_free, connect
from coop_drake.planning.walls import walls_for

_STEP = 0.03
_SPREAD_POSITION = 0.3
_SPREAD_ANGLE = 0.5
_ROOTS = 24
_NO_PATH = np.empty((0, 3))


class Sampler:
    """Looks for a path of configurations that stay in a workspace; deterministic for a seed.

    Args:
        problem: The whole question.
        workspace: Floor with the wanted clearance taken off [m].
        gap: Distance that pairs of bodies keep [m].
        seed: Seed of the samples.

    Attributes:
        stages: Robots that the last call of ``path`` had a path for before it ended.
    """

    def __init__(self, problem: PlanningProblem, workspace: MultiPolygon, gap: float, seed: int) -> None:
        self._problem, self._gap = problem, gap
        self._walls = walls_for(workspace, team_arrays(problem.tree))
        self._bounds = workspace.bounds
        self._random = np.random.default_rng(seed)
        self.stages = 0

    def path(self, samples: int) -> FloatArray:
        """Path from start to goal, theta unwrapped, shape (m, 3 + n); no rows if none was found.

        The object goes first; each robot is added with samples around the path of those before.

        Args:
            samples: Samples spent at most on each stage.
        """
        robots = sorted({joint.robot for joint in self._problem.tree.joints})
        guide = _NO_PATH
        known: tuple[int, ...] = ()
        for count in range(len(robots) + 1):
            self.stages = count
            question, joints = relaxed(self._problem, robots[:count])
            found = self._stage(question, joints, guide, known, samples)
            if len(found) == 0:
                return found
            guide, known = found, joints
        return guide

    def _stage(
        self,
        question: PlanningProblem,
        joints: tuple[int, ...],
        guide: FloatArray,
        known: tuple[int, ...],
        samples: int,
    ) -> FloatArray:
        tree = question.tree
        team = team_arrays(tree)
        scale = configuration_scale(tree)
        lower = np.array([*self._bounds[:2], -np.pi, *tree.joint_lower])
        upper = np.array([*self._bounds[2:], np.pi, *tree.joint_upper])
        size = len(lower)
        around = np.zeros((0, size))
        spread = np.zeros(size)
        if len(guide):
            dense = densified(guide, np.ones(guide.shape[1]), 0.1)
            around = np.zeros((len(dense), size))
            around[:, :3] = dense[:, :3]
            spread[:2], spread[2] = _SPREAD_POSITION, _SPREAD_ANGLE
            for place, joint in enumerate(known):
                here = 3 + joints.index(joint)
                around[:, here] = dense[:, 3 + place]
                spread[here] = _SPREAD_ANGLE
        roots = self._goals(question, around)
        if len(roots) == 0 or not is_free(team, self._walls, question.start, self._gap):
            return np.empty((0, size))
        uniforms = self._random.random((samples, 2 + size))
        path: FloatArray = connect(
            team,
            self._walls,
            question.start.astype(float),
            roots,
            around,
            spread,
            lower,
            upper,
            scale,
            self._gap,
            _STEP,
            uniforms,
        )
        if len(path) == 0:
            return path
        return self._shortened(question, path, scale)

    def _goals(self, question: PlanningProblem, around: FloatArray) -> FloatArray:
        """Free goal configurations: fixed joints as asked, free ones at random."""
        tree = question.tree
        team = team_arrays(tree)
        lower, upper = tree.joint_lower, tree.joint_upper
        roots: list[FloatArray] = []
        free = [i for i, value in enumerate(question.goal_joints) if value is None]
        for attempt in range(40 * _ROOTS if free else 1):
            joints = np.array([0.0 if value is None else value for value in question.goal_joints])
            if free:
                u = self._random.random(len(free))
                joints[free] = lower[free] + u * (upper - lower)[free]
            del attempt
            z = np.concatenate((question.goal_pose, joints))
            if is_free(team, self._walls, z, self._gap):
                roots.append(z)
            if len(roots) == _ROOTS:
                break
        return np.array(roots).reshape(-1, 3 + len(tree.joints))

    def _shortened(self, question: PlanningProblem, path: FloatArray, scale: FloatArray) -> FloatArray:
        """Straighten a path: first all axes together, then one by one."""
        team = team_arrays(question.tree)
        path = densified(path, scale, 0.1)
        for attempt in range(150):
            if len(path) < 3:
                break
            i, j = np.sort(self._random.integers(0, len(path), 2))
            if j - i < 2:
                continue
            axes = slice(None) if attempt % 3 == 0 else [int(self._random.integers(2, path.shape[1]))]
            part = path[i : j + 1].copy()
            share = np.linspace(0.0, 1.0, j - i + 1)[:, None]
            part[:, axes] = (path[i] + share * (path[j] - path[i]))[:, axes]
            if chain_is_free(team, self._walls, part, self._gap, scale, _STEP):
                path[i : j + 1] = part
        return path


def densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """The same path with no two neighbours further apart than a step in any scaled axis; shape (m, d)."""
    parts = [path[:1]]
    for first, last in pairwise(path):
        count = max(1, int(np.ceil(np.abs((last - first) * scale).max() / step)))
        parts.append(first + (last - first) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(parts)
