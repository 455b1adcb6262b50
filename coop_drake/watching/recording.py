"""Recording a search: one planning problem, and all events while the planner answers it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from manifold3d import CrossSection, FillRule

from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.planning.cells.as_printed import PaperExploration
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    Exploration,
    ExplorationBegan,
    ExplorationEnded,
    SeenCell,
    SliceAdded,
    Verdict,
)
from coop_drake.planning.cells.graph import Kind
from coop_drake.planning.channel import Channel
from coop_drake.planning.questions import marginal_workspace
from coop_drake.planning.search import find_channel
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray

BOXES = "boxes along a sampled path"
"""The question of the events that add the boxes of a channel one by one."""


Strategy = Literal["cells", "paper", "portfolio"]
"""Which search is recorded: the exploration of the whole team by cells; that exploration as the paper's
Algorithms 1 and 2 are printed; or all that planning does: proofs of infeasibility where it tries them, and
boxes along a sampled path."""


@dataclass(frozen=True, eq=False)
class SearchRecording:
    """A recording of one search.

    Attributes:
        problem: The planning problem.
        margin: Clearance from the walls that was asked for [m].
        events: What happened, in order.
        verdict: How the search ended.
        reason: Why there is no channel, in a sentence; empty if the events say it.
    """

    problem: PlanningProblem
    margin: float
    events: tuple[Event, ...]
    verdict: Verdict
    reason: str = ""

    def axes_of(self, robots: tuple[int, ...]) -> list[int]:
        """Return the indices of theta and of some robots' joints among the axes (theta, q...) of the team."""
        joints = self.problem.tree.joints
        return [0, *[1 + joint.index for joint in joints if joint.robot in robots]]

    def circular_of(self, robots: tuple[int, ...]) -> tuple[bool, ...]:
        """Return which axes of theta and of some robots' joints are circles."""
        circular = self.problem.tree.circular
        return tuple(circular[axis] for axis in self.axes_of(robots))

    def start_of(self, robots: tuple[int, ...]) -> FloatArray:
        """Return the start (x, y, theta, q...) with some robots' joints only, shape (2 + axes,) [m, rad]."""
        return self.problem.start[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    def goal_of(self, robots: tuple[int, ...]) -> FloatArray:
        """Return the goal with some robots' joints only, NaN for free ones, shape (2 + axes,) [m, rad]."""
        goal = at_goal(self.problem.goal_pose, self.problem.goal_joints, np.nan)
        return goal[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of all axes for captions: θ, then every joint."""
        return ("θ", *(joint.name.replace("::", " ") for joint in self.problem.tree.joints))


def record_search(
    problem: PlanningProblem, strategy: Strategy, margin: float, progress: Progress | None = None
) -> SearchRecording:
    """Search for a plan, and record every event of the search.

    The problem's settings give the budget of slices. The portfolio keeps less than the margin from the walls
    [m] where there is less.
    """
    if strategy == "portfolio":
        return _record_portfolio(problem, margin, progress)
    events: list[Event] = []
    algorithm = Exploration if strategy == "cells" else PaperExploration
    exploration = algorithm(problem, marginal_workspace(problem, margin), events.append)
    budget = problem.settings.max_slices

    def count(slices: int) -> None:
        if progress is not None:
            progress(f"{slices} slices", slices / budget)

    outcome = exploration.run(budget, count)
    return SearchRecording(problem, margin, tuple(events), outcome.verdict)


def _record_portfolio(problem: PlanningProblem, margin: float, progress: Progress | None) -> SearchRecording:
    """Record the proofs of infeasibility, then the boxes of the channel one by one."""
    events: list[Event] = []
    asked = replace(problem, settings=replace(problem.settings, strategy="portfolio", margin=margin))
    answer, _ = find_channel(asked, progress, watch=events.append)
    if isinstance(answer, Channel):
        events += _box_events(answer, tuple(sorted({joint.robot for joint in problem.tree.joints})))
        return SearchRecording(problem, answer.margin, tuple(events), Verdict.FOUND)
    verdict = Verdict.INFEASIBLE if answer.proved else Verdict.BUDGET
    last = events[-1] if events else None
    if not (isinstance(last, ExplorationEnded) and last.verdict == verdict.value):
        events += [ExplorationBegan(answer.reason, ()), ExplorationEnded(verdict.value, 0)]
    return SearchRecording(problem, 0.0, tuple(events), verdict, answer.reason)


def _box_events(channel: Channel, robots: tuple[int, ...]) -> list[Event]:
    """Return the boxes of a channel as events: each box is a slice of its own that is free."""
    events: list[Event] = [ExplorationBegan(BOXES, robots)]
    cells: list[SeenCell] = []
    for number, box in enumerate(channel.boxes):
        section = CrossSection(polygon_rings(box.polygon), FillRule.Positive)
        cell = SeenCell(number, Kind.FREE, Region.of(section))
        cells.append(cell)
        intervals = tuple((float(a), float(b)) for a, b in zip(box.lower, box.upper, strict=True))
        events += [SliceAdded(number, intervals, (cell,)), ChannelSearched(tuple(cells), float(len(cells)))]
    return [*events, ExplorationEnded(Verdict.FOUND.value, len(channel.boxes))]
