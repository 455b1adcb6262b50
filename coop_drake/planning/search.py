"""Find a channel of free boxes from start to goal, or prove that there is none: margin first (rule 1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.planning.attempts import SampledAttempts, explorer, refuted_relaxation
from coop_drake.planning.channel import Channel, SearchReport
from coop_drake.planning.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.goals import blocked_goal
from coop_drake.planning.margins import margins
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.relaxation import relaxed
from coop_drake.planning.separation import Separation

Progress = Callable[[str, float], None]
_RELAXED_SHARE = 2
_FIRST_SHARE = 500


@dataclass(frozen=True)
class NoChannel:
    """No channel was found.

    Attributes:
        proved: True if none exists, False if the work or the resolution ended first.
        reason: Why, in a sentence.
        separation: The proof in a form that can be checked again, where there is one.
    """

    proved: bool
    reason: str
    separation: Separation | None = None


def find_channel(
    problem: PlanningProblem, progress: Progress | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Search at the largest margin that works; if none does, explore at margin zero for an answer.

    Sampled paths that are certified box by box come first, in workspaces shrunk by the margin. What they
    cannot find, the exploration by cells decides; only it may answer "infeasible", and only at margin zero.
    Budgets are counted in samples and slices, never in time, so the same question has the same answer.

    Args:
        problem: The question.
        progress: Called with a phase and the share of it that is done.

    Returns:
        The channel, or why there is none, and a report.
    """
    blocked, slices = blocked_goal(problem)
    if blocked:
        reason = "the team collides at the goal pose whatever its free joints"
        return NoChannel(True, reason), SearchReport(slices, 0, 0, ((0.0, Verdict.INFEASIBLE.value),))
    attempts = SampledAttempts(problem)
    tried: list[tuple[float, str]] = []
    budget = problem.settings.max_slices
    refutable = True
    for margin in margins(problem.settings.margin):
        told = _teller(progress, f"searching at margin {margin:.3f} m")
        told(0.0)
        boxes = attempts.boxes(margin, progress=told)
        tried.append((margin, "found" if boxes is not None else "not found"))
        if boxes is not None:
            report = SearchReport(slices + attempts.slices, len(boxes), 0, tuple(tried))
            return attempts.channel(boxes, margin), report
        if refutable and attempts.object_blocked:
            refutable = False
            outcome = explorer(relaxed(problem, ())[0]).run(budget // _RELAXED_SHARE)
            slices += outcome.slices
            if outcome.verdict is Verdict.INFEASIBLE:
                tried.append((0.0, outcome.verdict.value))
                return _refuted("the object alone", slices + attempts.slices, tried)
    return _decided(problem, attempts, slices, tried, progress)


def _refuted(what: str, slices: int, tried: list[tuple[float, str]]) -> tuple[NoChannel, SearchReport]:
    reason = f"the over-approximations of {what} separate start from goal"
    return NoChannel(True, reason), SearchReport(slices, 0, 0, tuple(tried))


def _decided(
    problem: PlanningProblem,
    attempts: SampledAttempts,
    slices: int,
    tried: list[tuple[float, str]],
    progress: Progress | None,
) -> tuple[Channel | NoChannel, SearchReport]:
    """Answer at margin zero: relaxations first, then the whole in turns with more samples."""
    budget = problem.settings.max_slices
    what, made = refuted_relaxation(problem, budget // _RELAXED_SHARE)
    slices += made
    if what is not None:
        tried.append((0.0, Verdict.INFEASIBLE.value))
        return _refuted(what, slices + attempts.slices, tried)
    exploration = explorer(problem)
    share, effort = min(_FIRST_SHARE, budget), 0
    outcome = exploration.run(share, _counter(progress, budget))
    while outcome.verdict is Verdict.BUDGET and share < budget:
        share, effort = min(2 * share, budget), effort + 1
        boxes = attempts.boxes(0.0, effort)
        if boxes is not None:
            tried.append((0.0, Verdict.FOUND.value))
            report = _report(exploration, outcome, slices + attempts.slices + outcome.slices, tried)
            return attempts.channel(boxes, 0.0), report
        outcome = exploration.run(share, _counter(progress, budget))
    tried.append((0.0, outcome.verdict.value))
    report = _report(exploration, outcome, slices + attempts.slices + outcome.slices, tried)
    if outcome.verdict is not Verdict.FOUND:
        return _refusal(outcome), report
    return attempts.channel(exploration.boxes(outcome.path), 0.0), report


def _teller(progress: Progress | None, phase: str) -> Callable[[float], None]:
    """Tell the share of a phase, or nobody."""
    return (lambda share: None) if progress is None else (lambda share: progress(phase, share))


def _counter(progress: Progress | None, budget: int) -> Callable[[int], None]:
    """Tell the share of the budget that slices have taken."""
    told = _teller(progress, "exploring slices")
    return lambda count: told(count / budget)


def _refusal(outcome: Outcome) -> NoChannel:
    if outcome.verdict is Verdict.INFEASIBLE:
        return NoChannel(True, f"the over-approximations of {outcome.slices} slices separate start from goal")
    return NoChannel(False, f"no answer after {outcome.slices} slices: {outcome.verdict.value}")


def _report(
    exploration: Exploration, outcome: Outcome, slices: int, tried: list[tuple[float, str]]
) -> SearchReport:
    free, mixed = exploration.counts()
    undecided = outcome.verdict in (Verdict.RESOLUTION, Verdict.BUDGET)
    resolution = exploration.widest(outcome.path) if undecided and tried[-1][1] != "found" else None
    return SearchReport(slices, free, mixed, tuple(tried), resolution)
