"""Find a channel of free boxes from start to goal, or prove that there is none: margin first (rule 1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes import make_channel
from coop_drake.planning.cells import CellMaker
from coop_drake.planning.channel import Channel, SearchReport
from coop_drake.planning.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.margins import marginal_workspace, margins
from coop_drake.planning.problem import PlanningProblem

Progress = Callable[[str, float], None]
_MARGIN_SHARE = 8


@dataclass(frozen=True)
class NoChannel:
    """No channel was found.

    Attributes:
        proved: True if none exists, False if the work or the resolution ended first.
        reason: Why, in a sentence.
    """

    proved: bool
    reason: str


def find_channel(
    problem: PlanningProblem, progress: Progress | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Search at the largest margin that works.

    Every margin is an attempt in a workspace shrunk for under- and over-cells alike, so a margin that is too
    large is refuted as fast as an infeasible problem. Only margin zero may answer "infeasible". Budgets are
    counted in slices, never in time.

    Args:
        problem: The question.
        progress: Called with a phase and the number of slices made in it.

    Returns:
        The channel, or why there is none, and a report.
    """
    swept = SweptTree(problem.tree)
    pairs = BodyPairs(swept)
    tried: list[tuple[float, str]] = []
    slices = 0
    for margin in margins(problem.settings.margin):
        exploration = Exploration(problem, marginal_workspace(problem, margin), swept, pairs)
        budget = (
            problem.settings.max_slices if margin == 0.0 else problem.settings.max_slices // _MARGIN_SHARE
        )
        outcome = exploration.run(budget, _counter(progress, margin))
        slices += outcome.slices
        tried.append((margin, outcome.verdict.value))
        if outcome.verdict is Verdict.FOUND:
            break
    report = _report(exploration, outcome, slices, tried)
    if outcome.verdict is Verdict.FOUND:
        full = CellMaker(swept, pairs, problem.workspace)
        boxes = [
            (exploration.slices.expanded(exploration.slices.all[cell.slice].intervals), cell.region)
            for cell in outcome.path
        ]
        angles = float(problem.start[2]), float(problem.goal_pose[2])
        return make_channel(boxes, full, margin, *angles), report
    return _refusal(outcome), report


def _counter(progress: Progress | None, margin: float) -> Callable[[int], None] | None:
    if progress is None:
        return None
    return lambda count: progress(f"searching at margin {margin:.3f} m", float(count))


def _refusal(outcome: Outcome) -> NoChannel:
    if outcome.verdict is Verdict.INFEASIBLE:
        return NoChannel(True, f"the over-approximations of {outcome.slices} slices separate start from goal")
    return NoChannel(False, f"no answer after {outcome.slices} slices: {outcome.verdict.value}")


def _report(
    exploration: Exploration, outcome: Outcome, slices: int, tried: list[tuple[float, str]]
) -> SearchReport:
    free, mixed = exploration.counts()
    resolution = None
    if outcome.verdict in (Verdict.RESOLUTION, Verdict.BUDGET):
        resolution = exploration.widest(outcome.path)
    return SearchReport(slices, free, mixed, tuple(tried), resolution)
