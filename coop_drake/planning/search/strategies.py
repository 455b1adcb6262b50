"""Strategies without samples: explorations by cells alone, with our split rules or as the paper has them."""

from __future__ import annotations

from collections.abc import Callable

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.search_report import SearchReport
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.boxes.boxes import Box, make_channel
from coop_drake.planning.boxes.channel import Channel, NoChannel
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.events import Watch
from coop_drake.planning.cells.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.cells.printed_algorithms import PaperExploration
from coop_drake.planning.proofs.proof_making import slices_proof
from coop_drake.planning.questions.margins import marginal_workspace, margins

Progress = Callable[[str, float], None]
_MARGIN_SHARE = 8


def explored_channel(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Search by cells alone; only an exploration at margin zero may answer "infeasible".

    Args:
        problem: The question; its strategy is ``cells``, which tries margins once there is a channel at
            none, each with an eighth of the slices, or ``paper``, which knows no margin.
        progress: Called with a phase and the share of the slices that are made.
        watch: Called with the events of explorations.

    Returns:
        The channel, or why there is none, and a report.
    """
    search = _Cells(problem, progress, watch)
    exploration, outcome = search.at(0.0)
    if outcome.verdict is not Verdict.FOUND:
        return _none(problem, exploration, outcome, search)
    first = problem.settings.margin if problem.settings.strategy == "cells" else 0.0
    for margin in margins(first):
        wider, found = search.at(margin)
        if found.verdict is Verdict.FOUND:
            boxes = _boxes(problem, wider.boxes(found.path), margin)
            return make_channel(problem, boxes, margin, None), search.report(wider)
    boxes = _boxes(problem, exploration.boxes(outcome.path), 0.0)
    return make_channel(problem, boxes, 0.0, None), search.report(exploration)


class _Cells:
    """Explorations of one question at several margins, and what they took."""

    def __init__(self, problem: PlanningProblem, progress: Progress | None, watch: Watch | None) -> None:
        self._problem, self._progress, self._watch = problem, progress, watch
        self._tried: list[tuple[float, str]] = []
        self._slices = 0

    def at(self, margin: float) -> tuple[Exploration | PaperExploration, Outcome]:
        """Explore at a margin, with all slices at none and with a share of them at others."""
        budget = self._problem.settings.max_slices
        exploration = _exploration(self._problem, margin, self._watch)
        share = budget // _MARGIN_SHARE if margin > 0.0 else budget
        outcome = exploration.run(share, _counter(self._progress, margin, budget))
        self._slices += outcome.slices
        self._tried.append((margin, outcome.verdict.value))
        return exploration, outcome

    def report(
        self, exploration: Exploration | PaperExploration, resolution: float | None = None
    ) -> SearchReport:
        """What the search did, with the cells of the exploration that answered."""
        return SearchReport(self._slices, *exploration.counts(), tuple(self._tried), resolution)


def _exploration(
    problem: PlanningProblem, margin: float, watch: Watch | None
) -> Exploration | PaperExploration:
    swept = SweptTree(problem.tree)
    workspace = marginal_workspace(problem, margin)
    if problem.settings.strategy == "paper":
        return PaperExploration(problem, workspace, swept, BodyPairs(swept), watch)
    words = f"the whole team at margin {margin:.3f} m" if margin > 0.0 else "the whole team"
    return Exploration(problem, workspace, swept, BodyPairs(swept), watch, words)


def _boxes(problem: PlanningProblem, found: list[tuple[Intervals, Region]], margin: float) -> list[Box]:
    """Cores with the positions around them that are free at no margin."""
    if margin == 0.0:
        return [Box(intervals, core, core) for intervals, core in found]
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


def _none(
    problem: PlanningProblem, exploration: Exploration | PaperExploration, outcome: Outcome, search: _Cells
) -> tuple[NoChannel, SearchReport]:
    """The answer of an exploration at margin zero that found nothing."""
    if outcome.verdict is Verdict.INFEASIBLE:
        robots = sorted({joint.robot for joint in problem.tree.joints})
        leaves = exploration.over_leaves()
        proof = slices_proof(problem, robots, exploration.slices, leaves)
        if proof is None:
            return NoChannel(False, "the proof that was found cannot be stated"), search.report(exploration)
        reason = f"the over-approximations of {outcome.slices} slices separate start from goal"
        return NoChannel(True, reason, proof), search.report(exploration)
    mixed = exploration.undecided(outcome.path)
    resolution = max((cell.share for cell in mixed), default=None)
    reason = f"no answer after {outcome.slices} slices: {outcome.verdict.value}"
    return NoChannel(False, reason, mixed=mixed), search.report(exploration, resolution)


def _counter(progress: Progress | None, margin: float, budget: int) -> Callable[[int], None] | None:
    """Tell the share of the budget that slices have taken."""
    if progress is None:
        return None
    phase = f"exploring slices at margin {margin:.3f} m"
    return lambda count: progress(phase, count / budget)
