"""Search by cells alone, without samples: with our order of splits, or as the paper prints it."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.search_report import SearchReport
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.boxes.boxes import Box, explored_channel, make_channel
from coop_drake.planning.boxes.channel import Channel, NoChannel
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.events import Watch
from coop_drake.planning.cells.exploration import Exploration, ExplorationResult, Subdivision, Verdict
from coop_drake.planning.cells.printed_algorithms import PaperExploration
from coop_drake.planning.proofs.proof_making import slices_proof
from coop_drake.planning.proofs.witnesses import Witnesses
from coop_drake.planning.questions.margins import marginal_workspace, margins
from coop_drake.progress import Progress

MARGIN_BUDGET_DIVISOR = 8
"""An exploration at a margin may make this fraction of the slices, one in eight: most of them fail, and a
plan at margin zero exists already."""


def search_by_cells(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Search by cells alone; only an exploration at margin zero may answer "infeasible".

    Args:
        problem: The question. Its strategy is ``cells``, which also tries margins once there is a channel at
            margin zero, or ``paper``, which always uses margin zero.
        progress: Called with a phase and the fraction of the slices that are made.
        watch: Called with the events of explorations.

    Returns:
        The channel, or why there is none, and a report.
    """
    exploration, outcome = _explore(problem, 0.0, progress, watch)
    slices = outcome.slices
    if outcome.verdict is not Verdict.FOUND:
        return _no_channel(problem, exploration, outcome), SearchReport(slices)
    for margin in margins(problem.settings.margin) if problem.settings.strategy == "cells" else ():
        wider, found = _explore(problem, margin, progress, watch)
        slices += found.slices
        if found.verdict is Verdict.FOUND:
            boxes = _boxes_at_margin(problem, wider.boxes(found.path))
            return make_channel(problem, boxes, margin, None), SearchReport(slices)
    return explored_channel(problem, exploration.boxes(outcome.path)), SearchReport(slices)


def _explore(
    problem: PlanningProblem, margin: float, progress: Progress | None, watch: Watch | None
) -> tuple[Subdivision, ExplorationResult]:
    """Explore at a margin, with all slices at margin zero and with a fraction of them at others."""
    budget = problem.settings.max_slices
    exploration = _exploration(problem, margin, watch)
    report = None
    if progress is not None:
        phase = f"exploring slices at margin {margin:.3f} m"
        report = lambda count: progress(phase, count / budget)  # noqa: E731
    return exploration, exploration.run(budget // MARGIN_BUDGET_DIVISOR if margin > 0.0 else budget, report)


def _exploration(problem: PlanningProblem, margin: float, watch: Watch | None) -> Subdivision:
    workspace = marginal_workspace(problem, margin)
    if problem.settings.strategy == "paper":
        return PaperExploration(problem, workspace, watch)
    words = f"the whole team at margin {margin:.3f} m" if margin > 0.0 else "the whole team"
    return Exploration(problem, workspace, watch, words)


def _boxes_at_margin(problem: PlanningProblem, found: list[tuple[Intervals, Region]]) -> list[Box]:
    """Boxes whose cores were found at a margin, with the positions around them that are free without it."""
    swept = SweptTree(problem.tree)
    maker = CellMaker(swept, BodyPairs(swept), problem.workspace)
    return [
        Box(
            intervals,
            max(
                maker.under_cells(intervals),
                key=lambda full: shared(full.section, core.section, over=False).area(),
            ),
            core,
        )
        for intervals, core in found
    ]


def _no_channel(problem: PlanningProblem, exploration: Subdivision, outcome: ExplorationResult) -> NoChannel:
    """The answer of an exploration at margin zero that found no channel."""
    if outcome.verdict is Verdict.INFEASIBLE:
        witnesses = Witnesses(problem.tree, exploration.swept, exploration.pairs, exploration.maker)
        proof = slices_proof(problem, exploration.slices, exploration.over_leaves(), witnesses)
        if proof is None:
            return NoChannel(False, "a proof of infeasibility was found but cannot be written down")
        reason = f"the over-approximations of {outcome.slices} slices separate start from goal"
        return NoChannel(True, reason, proof)
    reason = outcome.verdict.explanation(outcome.slices)
    return NoChannel(False, reason, mixed=exploration.undecided(outcome.path))
