"""The hierarchy of subsystems that paths are sampled for: a disc, the object, some robots, the whole team."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.relaxation import inscribed_disc, relaxed
from coop_drake.planning.sampling.collision_kernels import bodies_apart
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, place

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
        while most > LEAST_GAP and not all(bodies_apart(team, place(team, z), most) for team, z in ends):
            most *= 0.5
        return most


def disc_question(question: PlanningProblem) -> PlanningProblem:
    """The question for the largest disc inside one piece of the object, a relaxation of the team."""
    bodies = [body for body in question.tree.components[0].bodies if body.robot is None]
    discs = [_guiding_disc(shape) for body in bodies for shape in body.shapes]
    body = Body("disc", None, (max(discs, key=lambda disc: disc.radius),))
    tree = ComponentTree((Component("disc", None, None, (body,)),), frozenset())
    return replace(question, tree=tree)


def _guiding_disc(shape: ConvexShape) -> ConvexShape:
    """A disc inside a convex piece, a little smaller than the largest one."""
    tolerance = DISC_TOLERANCE * shapely.MultiPoint(shape.vertices).convex_hull.length
    disc = inscribed_disc(shape, tolerance)
    return replace(disc, radius=DISC_SHRINKAGE * (disc.radius - shape.radius) + shape.radius)
