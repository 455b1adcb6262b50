"""Find a channel of free boxes from start to goal, or prove that there is none: margin first (rule 1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.attempts import SampledAttempts, explore, refuted_relaxation
from coop_drake.planning.boxes import make_channel
from coop_drake.planning.cells import CellMaker
from coop_drake.planning.channel import Channel, SearchReport
from coop_drake.planning.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.margins import margins
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.relaxation import relaxed

Progress = Callable[[str, float], None]
_RELAXED_SHARE = 8


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
    """Search at the largest margin that works; if none does, explore at margin zero for an answer.

    Sampled paths that are certified box by box come first, in workspaces shrunk by the margin. What they
    cannot find, the exploration by cells decides; only it may answer "infeasible", and only at margin zero.
    Budgets are counted in samples and slices, never in time, so the same question has the same answer.

    Args:
        problem: The question.
        progress: Called with a phase and a count of the work done in it.

    Returns:
        The channel, or why there is none, and a report.
    """
    swept = SweptTree(problem.tree)
    pairs = BodyPairs(swept)
    attempts = SampledAttempts(problem, swept, pairs)
    tried: list[tuple[float, str]] = []
    budget = problem.settings.max_slices
    slices, refutable = 0, True
    for margin in margins(problem.settings.margin):
        if progress is not None:
            progress(f"searching at margin {margin:.3f} m", float(len(tried)))
        boxes = attempts.boxes(margin)
        tried.append((margin, "found" if boxes is not None else "not found"))
        if boxes is not None:
            full = CellMaker(swept, pairs, problem.workspace)
            angles = float(problem.start[2]), float(problem.goal_pose[2])
            report = SearchReport(slices, len(boxes), 0, tuple(tried))
            return make_channel(boxes, full, margin, *angles), report
        if refutable and attempts.object_blocked:
            refutable = False
            _, outcome = explore(relaxed(problem, ())[0], budget // _RELAXED_SHARE, None)
            slices += outcome.slices
            if outcome.verdict is Verdict.INFEASIBLE:
                tried.append((0.0, outcome.verdict.value))
                return _refuted("the object alone", slices, tried)
    return _decided(problem, swept, pairs, slices, tried, progress)


def _refuted(what: str, slices: int, tried: list[tuple[float, str]]) -> tuple[NoChannel, SearchReport]:
    reason = f"the over-approximations of {what} separate start from goal"
    return NoChannel(True, reason), SearchReport(slices, 0, 0, tuple(tried))


def _decided(
    problem: PlanningProblem,
    swept: SweptTree,
    pairs: BodyPairs,
    slices: int,
    tried: list[tuple[float, str]],
    progress: Progress | None,
) -> tuple[Channel | NoChannel, SearchReport]:
    """Answer at margin zero by exploring relaxations and then the whole."""
    what, made = refuted_relaxation(problem, problem.settings.max_slices // _RELAXED_SHARE)
    slices += made
    if what is not None:
        tried.append((0.0, Verdict.INFEASIBLE.value))
        return _refuted(what, slices, tried)
    exploration, outcome = explore(problem, problem.settings.max_slices, _counter(progress, 0.0))
    tried.append((0.0, outcome.verdict.value))
    report = _report(exploration, outcome, slices + outcome.slices, tried)
    if outcome.verdict is not Verdict.FOUND:
        return _refusal(outcome), report
    boxes = [
        (exploration.slices.expanded(exploration.slices.all[cell.slice].intervals), cell.region)
        for cell in outcome.path
    ]
    full = CellMaker(swept, pairs, problem.workspace)
    return make_channel(boxes, full, 0.0, float(problem.start[2]), float(problem.goal_pose[2])), report


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
