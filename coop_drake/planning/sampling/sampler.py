"""Candidate paths by sampling a hierarchy of subsystems: a disc, the object, single robots, more robots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions import relaxed
from coop_drake.planning.sampling.collision import (
    ALL,
    ObstacleGrid,
    bodies_apart,
    densified,
    grid_for_team,
    is_free,
)
from coop_drake.planning.sampling.trees import (
    GuidePath,
    SampledRegion,
    connect,
    empty_tree,
    joined,
    shortened,
)
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import (
    Body,
    Component,
    ComponentTree,
    ConvexShape,
    TeamArrays,
    configuration_scale,
    place,
)

# The hierarchy of subsystems that paths are sampled for: a disc, the object, some robots, the whole team.

DISC_TOLERANCE, DISC_SHRINKAGE = 1e-3, 0.98
"""Accuracy of a guiding disc over its piece's perimeter, and the factor by which it is smaller than the
largest one, so that it also passes where the piece does within that accuracy [-]."""

LEAST_GAP = 1e-6
"""Bodies that are nearer to each other than this at the start or goal count as touching [m]."""


class Subsystem:
    """The object with some of the robots: a relaxation of the question, as arrays for the kernels.

    Args:
        question: The whole question or a relaxation of it.
        joints: For each of its joints the index of that joint in the whole q.
    """

    def __init__(self, question: PlanningProblem, joints: tuple[int, ...]) -> None:
        self.question, self.joints = question, joints
        self.team: TeamArrays = question.tree.arrays
        self.scale = configuration_scale(question.tree)
        self.start = question.start.astype(float)


class SubsystemHierarchy:
    """The subsystems of one question, from a disc to the whole team; made once for all samplers.

    Args:
        problem: The question.
        route: A route for the disc, shape (k, 2) [m], where random trees would take long to find one.

    Attributes:
        robots: All robots, ascending.
        disc: The largest disc inside one piece of the object.
        route: As given.
    """

    def __init__(self, problem: PlanningProblem, route: FloatArray | None = None) -> None:
        self.route = route
        self.robots = tuple(sorted({joint.robot for joint in problem.tree.joints}))
        self._problem = problem
        self._subsystems: dict[tuple[int, ...], Subsystem] = {}
        self.disc = Subsystem(disc_question(relaxed(problem, ())[0]), ())

    def subsystem(self, robots: tuple[int, ...]) -> Subsystem:
        """The object with some of the robots, given in ascending order."""
        if robots not in self._subsystems:
            self._subsystems[robots] = Subsystem(*relaxed(self._problem, robots))
        return self._subsystems[robots]

    def gap_at_ends(self, most: float) -> float:
        """A distance that bodies keep at the start, and at the goal where its joints are given.

        Paths that keep more begin or end nowhere. A distance that is too large is halved until it is kept.

        Args:
            most: The distance that is returned where they keep it [m].
        """
        ends = [(self.subsystem(self.robots).team, self._problem.start)]
        goals = zip(self._problem.tree.joints, self._problem.goal_joints, strict=True)
        free = {joint.robot for joint, goal in goals if goal is None}
        held = self.subsystem(tuple(robot for robot in self.robots if robot not in free))
        goal = np.array([*held.question.goal_pose, *held.question.goal_joints], dtype=float)
        ends.append((held.team, goal))
        while most > LEAST_GAP and not all(bodies_apart(team, place(team, z), most, ALL) for team, z in ends):
            most *= 0.5
        return most


def disc_question(question: PlanningProblem) -> PlanningProblem:
    """The question for the largest disc inside one piece of the object, a relaxation of the team."""
    bodies = [body for body in question.tree.components[0].bodies if body.robot is None]
    discs = [guiding_disc(shape) for body in bodies for shape in body.shapes]
    body = Body("disc", None, (max(discs, key=lambda disc: disc.radius),))
    tree = ComponentTree((Component("disc", None, None, (body,)),), frozenset())
    return replace(question, tree=tree)


def guiding_disc(shape: ConvexShape) -> ConvexShape:
    """A disc inside a convex piece, a little smaller than the largest one if the piece has an interior."""
    if len(shape.vertices) < 3:
        return ConvexShape(shape.vertices.mean(axis=0, keepdims=True), shape.radius)
    ring = Polygon(shape.vertices)
    centre = shapely.maximum_inscribed_circle(ring, tolerance=DISC_TOLERANCE * ring.length).coords[0]
    depth = DISC_SHRINKAGE * float(ring.exterior.distance(Point(centre)))
    return ConvexShape(np.array([centre]), depth + shape.radius)


COLLISION_STEP = 0.03
"""Between two collision checks of a motion no axis moves the team further than this [m]."""

POSITION_SPREAD, ANGLE_SPREAD = 0.3, 0.5
"""How far samples lie from the guide path, in position [m] and in every angle or joint [rad or m]: about half
the width of a passage, and a quarter of a right angle on both sides."""

GOALS = 24
"""Goal configurations that a tree may end in, with different values of the free joints."""

GOAL_SAMPLES = 40 * GOALS
"""Values of the free joints that are drawn for them."""

SHORTCUTS = 60
"""Shortcuts that are tried on a new path."""

DISC_SAMPLES_FACTOR = UNGUIDED_SAMPLES_FACTOR = 2
"""The disc, and the team where it has no guide path, get this many times the samples of the others [-]."""

FEW_JOINTS = 3
"""Teams with more joints than this [-] are sampled as a whole at once, because samples of robot after robot
often fail; others in later attempts, because the first one gives paths that are quicker to follow."""

EVERYWHERE, WHERE_TREES_END = (400, 1), (0, 12)
"""Two ways to sample around a guide path: the number of its rows above which most samples are drawn where a
tree has come furthest, and the values that are tried of each component's axes until it is free [-]. The first
way gives straighter paths; the second one finds paths of large teams, few of whose samples are free."""

SPACING = 0.1
"""Distance between samples of guide paths, and of paths before shortcuts, in any scaled axis [m]."""

SAMPLED_LENGTH = 20.0
"""Length of a guide path for which one budget of samples is meant [m]; longer ones get a multiple."""

SPEED, TURN_RATE, JOINT_RATE = 1.2, 0.5, 0.6
"""Highest average speeds of position, theta and joints in simulated transports [m/s, rad/s]."""

_NO_PATH = np.empty((0, 3))
"""The result of a search for a path that found none: no rows."""


class Sampler:
    """Looks for a path of free configurations in a workspace; the same seed gives the same path.

    Args:
        hierarchy: The subsystems of the question.
        workspace: Floor with the wanted clearance taken off [m].
        gap: Distance that two bodies keep, unless they are nearer at the start or the goal [m].
        seed: Seed of the samples.
        progress: Called with the fraction of the subsystems that are done.

    Attributes:
        object_blocked: Whether no path was found even for the object alone.
    """

    def __init__(
        self,
        hierarchy: SubsystemHierarchy,
        workspace: MultiPolygon,
        gap: float,
        seed: int,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self._hierarchy, self._gap = hierarchy, hierarchy.gap_at_ends(gap)
        self._grid: ObstacleGrid = grid_for_team(workspace, hierarchy.subsystem(hierarchy.robots).team)
        self._bounds = workspace.bounds
        self._random = np.random.default_rng(seed)
        self._progress = progress
        self.object_blocked = False

    def path(self, samples: int, choices: int = 1) -> FloatArray:
        """Find a path from start to goal.

        A disc inside the object comes first, then the object around the disc's path, then the object with
        each single robot around the object's path. Robots are then added one by one, around the path found
        before; the robot that needed most samples comes first.

        Args:
            samples: Samples drawn at most for each subsystem.
            choices: Number of paths of the object, of which the one with the shortest duration is followed;
                it decides in which directions the team turns.

        Returns:
            Configurations with circular axes unwrapped, shape (m, 3 + n) [m, rad]; no rows if no path was
            found.
        """
        robots, subsystem = self._hierarchy.robots, self._hierarchy.subsystem
        steps = 2 + 2 * len(robots)
        disc = self._disc_path(samples)
        self._report(1 / steps)
        found = (self._guide(subsystem(()), disc, samples)[0] for _ in range(choices))
        best = min((guide for guide in found if guide is not None), key=_least_duration, default=None)
        self.object_blocked = best is None
        alone: list[tuple[int, int, GuidePath]] = []
        for robot in robots if best is not None else ():
            self._report((2 + len(alone)) / steps)
            guide, effort = self._guide(subsystem((robot,)), best, samples)
            if guide is None:
                guide, more = self._guide(subsystem((robot,)), disc, samples)
                effort += more
            if guide is None:
                return _NO_PATH
            alone.append((-effort, robot, guide))
        alone.sort(key=lambda entry: entry[:2])
        added: tuple[int, ...] = ()
        for _, robot, guide in alone:
            added = tuple(sorted((*added, robot)))
            self._report((1 + len(robots) + len(added)) / steps)
            best = guide if len(added) == 1 else self._guide(subsystem(added), best, samples)[0]
            if best is None:
                return _NO_PATH
        return _NO_PATH if best is None else best.path

    def direct_path(
        self, samples: int, part: tuple[int, ...] | None = None, *, anywhere: bool = True
    ) -> FloatArray:
        """Find a path for the whole team at once, see ``direct``.

        Args:
            samples: Samples drawn at most for each subsystem.
            part: Robots that are sampled with the object first, ascending; the team is then sampled around
                their path, and not at all if none is found. None: the team is sampled at once.
            anywhere: See ``direct``.

        Returns:
            As ``path``.
        """
        if part is not None:
            guide = self.direct(part, samples)
            path = _NO_PATH if guide is None else self.path_around(guide, samples)
            if guide is None or len(path):
                return path
        whole = self.direct(self._hierarchy.robots, samples, anywhere=anywhere)
        return _NO_PATH if whole is None else whole.path

    def direct(self, robots: tuple[int, ...], samples: int, *, anywhere: bool = True) -> GuidePath | None:
        """Find a path of the object with some robots at once, around the disc's path, else the object's.

        Samples are free component by component, and lie where the trees have come furthest. If neither guide
        helps, because the team has to take another way than the disc and the object, samples lie anywhere.

        Args:
            robots: The robots, ascending.
            samples: Samples drawn at most for each subsystem.
            anywhere: Whether samples lie anywhere if neither guide helps.

        Returns:
            The path, or None if none was found.
        """
        chosen, disc = self._hierarchy.subsystem(robots), self._disc_path(samples)
        found = None if disc is None else self._guide(chosen, disc, samples, WHERE_TREES_END)[0]
        self._report(0.5)
        if found is None and robots:
            alone, _ = self._guide(self._hierarchy.subsystem(()), disc, samples, WHERE_TREES_END)
            self.object_blocked = alone is None
            if alone is not None:
                found, _ = self._guide(chosen, alone, samples, WHERE_TREES_END)
        if found is None and anywhere:
            found, _ = self._guide(chosen, None, UNGUIDED_SAMPLES_FACTOR * samples)
            self.object_blocked = found is None and (self.object_blocked or not robots)
        return found

    def path_around(self, guide: GuidePath, samples: int) -> FloatArray:
        """Find a path for the whole team around another one, which need not be free.

        Args:
            guide: Path of the team or of a part of it.
            samples: Samples drawn at most.

        Returns:
            As ``path``.
        """
        whole = self._hierarchy.subsystem(self._hierarchy.robots)
        found, _ = self._guide(whole, guide, samples, WHERE_TREES_END)
        return _NO_PATH if found is None else found.path

    def _disc_path(self, samples: int) -> GuidePath | None:
        """Path of the disc: the route if there is one, else sampled."""
        route = self._hierarchy.route
        if route is not None:
            return GuidePath(np.column_stack((route, np.zeros(len(route)))), (), has_theta=False)
        disc, _ = self._guide(self._hierarchy.disc, None, DISC_SAMPLES_FACTOR * samples)
        return None if disc is None else replace(disc, has_theta=False)

    def _guide(
        self,
        subsystem: Subsystem,
        around: GuidePath | None,
        samples: int,
        way: tuple[int, int] = EVERYWHERE,
    ) -> tuple[GuidePath | None, int]:
        """Path of a subsystem, sampled around a guide path, and the number of samples drawn for it."""
        guide, spread = _sampling_region(subsystem, around)
        if not is_free(subsystem.team, self._grid, subsystem.start, self._gap):
            return None, 0
        roots = self._goals(subsystem)
        if len(roots) == 0:
            return None, 0
        length = 0.0 if around is None else np.hypot(*np.diff(around.path[:, :2], axis=0).T).sum()
        samples *= max(1, int(length / SAMPLED_LENGTH))
        path, drawn = self._connect(subsystem, roots, guide, spread, samples, way)
        return (GuidePath(self._shortened(subsystem, path), subsystem.joints) if len(path) else None), drawn

    def _connect(
        self,
        subsystem: Subsystem,
        roots: FloatArray,
        guide: FloatArray,
        spread: FloatArray,
        samples: int,
        way: tuple[int, int],
    ) -> tuple[FloatArray, int]:
        tree = subsystem.question.tree
        lower = np.array([*self._bounds[:2], -np.pi, *tree.range_lower])
        upper = np.array([*self._bounds[2:], np.pi, *tree.range_upper])
        circular = np.array([False, False, *tree.circular])
        uniforms = self._random.random((samples, 2 + len(lower)))
        capacity = 2 * samples + len(roots) + 1
        first, last = (empty_tree(capacity, lower, upper, circular) for _ in range(2))
        ends, goals, drawn = connect(
            subsystem.team,
            self._grid,
            (first, last),
            subsystem.start,
            roots,
            SampledRegion(guide, spread, lower, upper, circular, *way),
            subsystem.scale,
            self._gap,
            COLLISION_STEP,
            uniforms,
        )
        if not ends:
            return np.empty((0, len(lower))), drawn
        return joined(
            first._replace(nodes=first.nodes[:ends]), last._replace(nodes=last.nodes[:goals])
        ), drawn

    def _goals(self, subsystem: Subsystem) -> FloatArray:
        """Free goal configurations: joints with a goal have that value, the others random values."""
        question = subsystem.question
        lower, upper = question.tree.range_lower, question.tree.range_upper
        roots: list[FloatArray] = []
        free = [i for i, value in enumerate(question.goal_joints) if value is None]
        fixed = [0.0 if value is None else value for value in question.goal_joints]
        for _ in range(GOAL_SAMPLES if free else 1):
            joints = np.array(fixed)
            if free:
                joints[free] = lower[free] + self._random.random(len(free)) * (upper - lower)[free]
            z = np.concatenate((question.goal_pose, joints))
            if is_free(subsystem.team, self._grid, z, self._gap):
                roots.append(z)
            if len(roots) == GOALS:
                break
        return np.array(roots).reshape(-1, 3 + len(lower))

    def _shortened(self, subsystem: Subsystem, path: FloatArray) -> FloatArray:
        uniforms = self._random.random((SHORTCUTS, 3))
        path = densified(path, subsystem.scale, SPACING)
        better: FloatArray = shortened(
            subsystem.team, self._grid, path, subsystem.scale, self._gap, COLLISION_STEP, uniforms
        )
        return better

    def _report(self, fraction: float) -> None:
        if self._progress is not None:
            self._progress(fraction)


def _least_duration(guide: GuidePath) -> float:
    """Duration of a path of the object at the highest average speeds, however near the walls are [s]."""
    moved = np.abs(np.diff(guide.path[:, :3], axis=0))
    return float(np.maximum(np.hypot(moved[:, 0], moved[:, 1]) / SPEED, moved[:, 2] / TURN_RATE).sum())


def _sampling_region(subsystem: Subsystem, around: GuidePath | None) -> tuple[FloatArray, FloatArray]:
    """Configurations to sample around, and how far in every axis; zero for axes without a guide."""
    size = 3 + len(subsystem.joints)
    spread = np.zeros(size)
    if around is None:
        return np.zeros((0, size)), spread
    dense = densified(around.path, np.ones(around.path.shape[1]), SPACING)
    guide = np.zeros((len(dense), size))
    columns = [0, 1, 2, *[3 + subsystem.joints.index(joint) for joint in around.joints]]
    guide[:, columns] = dense
    if not around.has_theta:
        columns.remove(2)
    spread[columns] = ANGLE_SPREAD
    spread[:2] = POSITION_SPREAD
    return guide, spread
