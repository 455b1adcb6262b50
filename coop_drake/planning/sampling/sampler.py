"""Candidate paths by sampling: a disc, the object, each robot alone, and robots added hardest first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from shapely import MultiPoint, MultiPolygon, Polygon, maximum_inscribed_circle

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.relaxation import relaxed
from coop_drake.planning.sampling.collision_kernels import is_free
from coop_drake.planning.sampling.obstacle_grid import Walls, walls_for
from coop_drake.planning.sampling.random_trees import connect, shortened
from coop_drake.planning.sampling.team_arrays import TeamArrays, team_arrays
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

_STEP = 0.03
_SPREAD_POSITION = 0.3
_SPREAD_ANGLE = 0.5
_ROOTS = 24
_SHORTCUTS = 60
_DISC_SHARE = 2
_SPACING = 0.1
_SAMPLED_LENGTH = 20.0
"""Length of a guide that one budget of samples is meant for [m]."""

SPEED, TURN_RATE, JOINT_RATE = 1.2, 0.5, 0.6
"""Speeds of position, theta and joints with which transports go at their best [m/s, rad/s]."""

_NO_PATH = np.empty((0, 3))


@dataclass(frozen=True)
class Guide:
    """A path of some of the robots to sample around.

    Attributes:
        path: Configurations, shape (m, 3 + k).
        joints: For each of its joints the index of that joint in the whole q.
        turned: Whether theta means anything along it.
    """

    path: FloatArray
    joints: tuple[int, ...]
    turned: bool = True


class Stage:
    """A question laid out for the kernels.

    Args:
        question: The whole question or a relaxation of it.
        joints: For each of its joints the index of that joint in the whole q.
    """

    def __init__(self, question: PlanningProblem, joints: tuple[int, ...]) -> None:
        self.question, self.joints = question, joints
        self.team: TeamArrays = team_arrays(question.tree)
        self.scale = configuration_scale(question.tree)
        self.start = question.start.astype(float)


class Ladder:
    """Stages of one question, made once for all samplers."""

    def __init__(self, problem: PlanningProblem) -> None:
        self.robots = tuple(sorted({joint.robot for joint in problem.tree.joints}))
        self._problem = problem
        self._stages: dict[tuple[int, ...], Stage] = {}
        self.disc = Stage(_disc_question(relaxed(problem, ())[0]), ())

    def stage(self, robots: tuple[int, ...]) -> Stage:
        """The stage with some of the robots, in ascending order."""
        if robots not in self._stages:
            self._stages[robots] = Stage(*relaxed(self._problem, robots))
        return self._stages[robots]


class Sampler:
    """Looks for a path of configurations that stay in a workspace; deterministic for a seed.

    Args:
        ladder: The question.
        workspace: Floor with the wanted clearance taken off [m].
        gap: Distance that pairs of bodies keep [m].
        seed: Seed of the samples.
        progress: Called with the share of the ladder that is done.

    Attributes:
        object_blocked: Whether no path was found even for the object alone.
    """

    def __init__(
        self,
        ladder: Ladder,
        workspace: MultiPolygon,
        gap: float,
        seed: int,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self._ladder, self._gap = ladder, gap
        self._walls: Walls = walls_for(workspace, ladder.stage(ladder.robots).team)
        self._bounds = workspace.bounds
        self._random = np.random.default_rng(seed)
        self._tell = progress
        self.object_blocked = False

    def path(self, samples: int, choices: int = 1) -> FloatArray:
        """Path from start to goal, theta unwrapped, shape (m, 3 + n); no rows if none was found.

        A disc inside the object goes first, then the object around the disc's path, then each robot around
        the object's; the more samples it takes the harder the robot. Robots are added hardest first, around
        the path of those before.

        Args:
            samples: Samples drawn at most for each stage.
            choices: Paths of the object among which the quickest is taken, for it decides how all turn.
        """
        robots, stage = self._ladder.robots, self._ladder.stage
        steps = 2 + 2 * len(robots)
        disc, _ = self._guide(self._ladder.disc, None, _DISC_SHARE * samples)
        disc = None if disc is None else replace(disc, turned=False)
        self._told(1 / steps)
        found = (self._guide(stage(()), disc, samples)[0] for _ in range(choices))
        best = min((guide for guide in found if guide is not None), key=_hurried, default=None)
        self.object_blocked = best is None
        alone: list[tuple[int, int, Guide]] = []
        for robot in robots if best is not None else ():
            self._told((2 + len(alone)) / steps)
            guide, effort = self._guide(stage((robot,)), best, samples)
            if guide is None:
                guide, more = self._guide(stage((robot,)), disc, samples)
                effort += more
            if guide is None:
                return _NO_PATH
            alone.append((-effort, robot, guide))
        alone.sort(key=lambda entry: entry[:2])
        added: tuple[int, ...] = ()
        for _, robot, guide in alone:
            added = tuple(sorted((*added, robot)))
            self._told((1 + len(robots) + len(added)) / steps)
            best = guide if len(added) == 1 else self._guide(stage(added), best, samples)[0]
            if best is None:
                return _NO_PATH
        return _NO_PATH if best is None else best.path

    def _guide(self, stage: Stage, around: Guide | None, samples: int) -> tuple[Guide | None, int]:
        """Path of a stage, sampled around another one's, and the samples drawn for it."""
        guide, spread = _corridor(stage, around)
        if not is_free(stage.team, self._walls, stage.start, self._gap):
            return None, 0
        roots = self._goals(stage)
        if len(roots) == 0:
            return None, 0
        length = 0.0 if around is None else np.hypot(*np.diff(around.path[:, :2], axis=0).T).sum()
        samples *= max(1, int(length / _SAMPLED_LENGTH))
        path, drawn = self._connect(stage, roots, guide, spread, samples)
        return (Guide(self._shortened(stage, path), stage.joints) if len(path) else None), drawn

    def _connect(
        self, stage: Stage, roots: FloatArray, guide: FloatArray, spread: FloatArray, samples: int
    ) -> tuple[FloatArray, int]:
        tree = stage.question.tree
        lower = np.array([*self._bounds[:2], -np.pi, *tree.joint_lower])
        upper = np.array([*self._bounds[2:], np.pi, *tree.joint_upper])
        uniforms = self._random.random((samples, 2 + len(lower)))
        path, drawn = connect(
            stage.team,
            self._walls,
            stage.start,
            roots,
            guide,
            spread,
            lower,
            upper,
            stage.scale,
            self._gap,
            _STEP,
            uniforms,
        )
        return path, drawn

    def _goals(self, stage: Stage) -> FloatArray:
        """Free goal configurations: fixed joints as asked, free ones at random."""
        question = stage.question
        lower, upper = question.tree.joint_lower, question.tree.joint_upper
        roots: list[FloatArray] = []
        free = [i for i, value in enumerate(question.goal_joints) if value is None]
        fixed = [0.0 if value is None else value for value in question.goal_joints]
        for _ in range(40 * _ROOTS if free else 1):
            joints = np.array(fixed)
            if free:
                joints[free] = lower[free] + self._random.random(len(free)) * (upper - lower)[free]
            z = np.concatenate((question.goal_pose, joints))
            if is_free(stage.team, self._walls, z, self._gap):
                roots.append(z)
            if len(roots) == _ROOTS:
                break
        return np.array(roots).reshape(-1, 3 + len(lower))

    def _shortened(self, stage: Stage, path: FloatArray) -> FloatArray:
        uniforms = self._random.random((_SHORTCUTS, 3))
        path = densified(path, stage.scale, _SPACING)
        better: FloatArray = shortened(stage.team, self._walls, path, stage.scale, self._gap, _STEP, uniforms)
        return better

    def _told(self, share: float) -> None:
        if self._tell is not None:
            self._tell(share)


def _hurried(guide: Guide) -> float:
    """Least time that a path of the object may take, walls aside [s]."""
    moved = np.abs(np.diff(guide.path[:, :3], axis=0))
    return float(np.maximum(np.hypot(moved[:, 0], moved[:, 1]) / SPEED, moved[:, 2] / TURN_RATE).sum())


def _corridor(stage: Stage, around: Guide | None) -> tuple[FloatArray, FloatArray]:
    """Configurations to sample around and how far, zero for axes that the guide does not know."""
    size = 3 + len(stage.joints)
    spread = np.zeros(size)
    if around is None:
        return np.zeros((0, size)), spread
    dense = densified(around.path, np.ones(around.path.shape[1]), _SPACING)
    guide = np.zeros((len(dense), size))
    columns = [0, 1, 2, *[3 + stage.joints.index(joint) for joint in around.joints]]
    guide[:, columns] = dense
    if not around.turned:
        columns.remove(2)
    spread[columns] = _SPREAD_ANGLE
    spread[:2] = _SPREAD_POSITION
    return guide, spread


def _disc_question(question: PlanningProblem) -> PlanningProblem:
    """The question for the largest disc inside one piece of the object: what blocks it blocks the team."""
    bodies = [body for body in question.tree.components[0].bodies if body.robot is None]
    discs = [_inscribed(shape) for body in bodies for shape in body.shapes]
    body = Body("disc", None, (max(discs, key=lambda disc: disc.radius),))
    tree = ComponentTree((Component("disc", None, None, (body,)),), frozenset())
    return replace(question, tree=tree)


def _inscribed(shape: ConvexShape) -> ConvexShape:
    """A disc inside a convex piece."""
    hull = MultiPoint(shape.vertices).convex_hull
    if not isinstance(hull, Polygon):
        return ConvexShape(shape.vertices.mean(axis=0, keepdims=True), shape.radius)
    line = maximum_inscribed_circle(hull, tolerance=1e-3 * hull.length)
    return ConvexShape(np.array(line.coords[:1]), 0.98 * line.length + shape.radius)


def densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """The same path with no two neighbours further apart than a step in any scaled axis; shape (m, d)."""
    if len(path) < 2:
        return path.copy()
    moved = np.abs(np.diff(path, axis=0) * scale).max(axis=1)
    parts = np.maximum(1, np.ceil(moved / step)).astype(int)
    rows = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(rows)) - np.repeat(np.cumsum(parts) - parts, parts) + 1.0) / parts[rows]
    dense: FloatArray = path[rows] + share[:, None] * (path[rows + 1] - path[rows])
    return np.concatenate((path[:1], dense))
