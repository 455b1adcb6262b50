"""A film: one question to the planner and everything that was told while it was answered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from manifold3d import CrossSection, FillRule

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.minkowski import polygon_rings
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes.channel import Channel
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.events import (
    ChannelSearched,
    Event,
    ExplorationBegan,
    ExplorationEnded,
    SeenCell,
    SliceAdded,
)
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.cells.printed_algorithms import PaperExploration
from coop_drake.planning.questions.margins import marginal_workspace
from coop_drake.planning.search.search import find_channel
from coop_drake.tree.pose import FloatArray

__all__ = ["BOXES", "Film", "Strategy", "record"]

Progress = Callable[[str, float], None]

BOXES = "boxes along a sampled path"
"""The question under which the boxes of a channel are laid one by one."""


class Strategy(Enum):
    """What is watched."""

    CELLS = "cells"
    """The exploration of the whole team by cells."""
    PAPER = "paper"
    """The same as the paper's Algorithms 1 and 2 are printed."""
    PORTFOLIO = "portfolio"
    """All that planning does: proofs, where it needs them, and the boxes along a sampled path."""


@dataclass(frozen=True, eq=False)
class Film:
    """A recording of one search.

    Attributes:
        problem: The question.
        strategy: How it was searched.
        margin: Clearance from the walls that was asked for [m].
        events: What was told, in order.
        verdict: How it ended.
        reason: Why there is no channel, in a sentence; empty if the events tell.
    """

    problem: PlanningProblem
    strategy: Strategy
    margin: float
    events: tuple[Event, ...]
    verdict: Verdict
    reason: str = ""

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
        """Names of all axes as people read them: θ, then every joint."""
        return ("θ", *(joint.name.replace("::", " ") for joint in self.problem.tree.joints))


def record(
    problem: PlanningProblem, strategy: Strategy, margin: float, progress: Progress | None = None
) -> Film:
    """Answer a question once more, and record what is told on the way.

    Args:
        problem: The question; its settings give the budget of slices.
        strategy: What to watch.
        margin: Clearance to keep from the walls [m]; the portfolio takes less where there is less.
        progress: Called with a text and the share of the work that is done.
    """
    if strategy is Strategy.PORTFOLIO:
        return _film_portfolio(problem, margin, progress)
    events: list[Event] = []
    swept = SweptTree(problem.tree)
    made = Exploration if strategy is Strategy.CELLS else PaperExploration
    exploration = made(problem, marginal_workspace(problem, margin), swept, BodyPairs(swept), events.append)
    budget = problem.settings.max_slices

    def count(slices: int) -> None:
        if progress is not None:
            progress(f"{slices} slices", slices / budget)

    outcome = exploration.run(budget, count)
    return Film(problem, strategy, margin, tuple(events), outcome.verdict)


def _film_portfolio(problem: PlanningProblem, margin: float, progress: Progress | None) -> Film:
    """Record the proofs, then lay the boxes of the channel one by one."""
    events: list[Event] = []
    question = replace(problem, settings=replace(problem.settings, strategy="portfolio", margin=margin))
    answer, _ = find_channel(question, progress, watch=events.append)
    if isinstance(answer, Channel):
        events += _laid(answer, tuple(sorted({joint.robot for joint in problem.tree.joints})))
        return Film(problem, Strategy.PORTFOLIO, answer.margin, tuple(events), Verdict.FOUND)
    verdict = Verdict.INFEASIBLE if answer.proved else Verdict.BUDGET
    last = events[-1] if events else None
    if not (isinstance(last, ExplorationEnded) and last.verdict == verdict.value):
        events += [ExplorationBegan(answer.reason, ()), ExplorationEnded(verdict.value, 0)]
    return Film(problem, Strategy.PORTFOLIO, 0.0, tuple(events), verdict, answer.reason)


def _laid(channel: Channel, robots: tuple[int, ...]) -> list[Event]:
    """The boxes of a channel as events: each is a slice of its own that is free."""
    events: list[Event] = [ExplorationBegan(BOXES, robots)]
    chain: list[SeenCell] = []
    for number, box in enumerate(channel.boxes):
        section = CrossSection(polygon_rings(box.polygon), FillRule.Positive)
        cell = SeenCell(number, Kind.FREE, Region.of(section))
        chain.append(cell)
        intervals = tuple((float(a), float(b)) for a, b in zip(box.lower, box.upper, strict=True))
        events += [SliceAdded(number, intervals, (cell,)), ChannelSearched(tuple(chain), float(len(chain)))]
    return [*events, ExplorationEnded(Verdict.FOUND.value, len(channel.boxes))]
