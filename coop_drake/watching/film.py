"""A film: one question to the planner and everything that was told while it was answered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.events import Event
from coop_drake.planning.exploration import Exploration, Verdict
from coop_drake.planning.margins import marginal_workspace
from coop_drake.planning.problem import PlanningProblem

__all__ = ["Film", "film_cells"]

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Film:
    """A recording of one search.

    Attributes:
        problem: The question.
        strategy: How it was searched: ``cells``, ``paper`` or ``portfolio``.
        margin: Clearance from the walls that was asked for [m].
        events: What was told, in order.
        verdict: How it ended.
    """

    problem: PlanningProblem
    strategy: str
    margin: float
    events: tuple[Event, ...]
    verdict: Verdict

    def axes_of(self, robots: tuple[int, ...]) -> list[int]:
        """Indices into (theta, q...) of the whole team of the axes that some robots have."""
        joints = self.problem.tree.joints
        return [0, *[1 + joint.index for joint in joints if joint.robot in robots]]

    def start_of(self, robots: tuple[int, ...]) -> FloatArray:
        """The start (x, y, theta, q...) with the joints of some robots only, shape (2 + axes,) [m, rad]."""
        return self.problem.start[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    def goal_of(self, robots: tuple[int, ...]) -> FloatArray:
        """The goal with the joints of some robots only, NaN for free joints, shape (2 + axes,) [m, rad]."""
        joints = [np.nan if goal is None else goal for goal in self.problem.goal_joints]
        goal = np.array([*self.problem.goal_pose, *joints])
        return goal[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of all axes: theta, then every joint."""
        return ("theta", *(joint.name.replace("::", " ") for joint in self.problem.tree.joints))


def film_cells(problem: PlanningProblem, margin: float, progress: Progress | None = None) -> Film:
    """Explore the whole team by cells, and record it.

    Args:
        problem: The question; its settings give the budget of slices.
        margin: Clearance that the cells keep from the walls [m].
        progress: Called with a text and the share of the budget that is spent.
    """
    events: list[Event] = []
    swept = SweptTree(problem.tree)
    workspace = marginal_workspace(problem, margin)
    exploration = Exploration(problem, workspace, swept, BodyPairs(swept), watch=events.append)
    budget = problem.settings.max_slices

    def count(slices: int) -> None:
        if progress is not None:
            progress(f"{slices} slices", slices / budget)

    outcome = exploration.run(budget, count)
    return Film(problem, "cells", margin, tuple(events), outcome.verdict)
