"""The whole diagnosis: ask, widen, look where it was too narrow, and try changes to the team."""

from __future__ import annotations

from dataclasses import replace

from coop_drake.answers import PlanningProblem
from coop_drake.answers.proof import BlockedGoalProof
from coop_drake.diagnosis.blocking import Growths, blocking_passages
from coop_drake.diagnosis.bodies import without_walls
from coop_drake.diagnosis.bracket import Steps, bracketed
from coop_drake.diagnosis.contacts import deepest
from coop_drake.diagnosis.diagnosis import Diagnosis, PassageFindings
from coop_drake.diagnosis.goal import blocked_pose
from coop_drake.diagnosis.growth import Growth
from coop_drake.diagnosis.relaxations import try_changes
from coop_drake.diagnosis.squeeze import relieved, squeezed
from coop_drake.diagnosis.trials import Answer, Progress, Trial, Trials
from coop_drake.planning import Channel, find_channel

__all__ = ["diagnose"]

_SLICES = 120
_TOTAL = 30_000
_FIRST = 0.05
_MOST_OF_REACH = 0.5
_RESOLUTION = 0.0025
_TRIALS = 6


def diagnose(problem: PlanningProblem, progress: Progress | None = None) -> Diagnosis:
    """Say why no plan exists or none was found, and what would help.

    Amounts called refuted rest on proofs of the planner, amounts called enough on channels that it proved
    free; what is said about bodies and angles is read off one way and proves nothing.

    Args:
        problem: The question, with the margin and the budgets of the planner.
        progress: Called with a stage and the share of the work's budget that is spent.

    Returns:
        The diagnosis; the same for the same question.
    """
    answer, report = find_channel(problem, progress)
    if isinstance(answer, Channel):
        return Diagnosis(Answer.FOUND, "", margin=answer.margin, slices=report.slices)
    trials = Trials(_SLICES, _TOTAL, progress)
    first = Diagnosis(
        Answer.INFEASIBLE if answer.proved else Answer.UNDECIDED, answer.reason, mixed=answer.mixed
    )
    growth = Growth(problem.workspace, problem.start[:2], _MOST_OF_REACH * problem.tree.reach)
    if isinstance(answer.proof, BlockedGoalProof):
        made = replace(first, goal=blocked_pose(problem, growth, trials))
    else:
        findings = _passages(problem, growth, trials, refuted=answer.proved)
        made = replace(first, passages=findings)
    made = replace(made, relaxations=tuple(try_changes(problem, trials, refuted=answer.proved)))
    return replace(made, slices=report.slices + trials.spent)


def _passages(problem: PlanningProblem, growth: Growth, trials: Trials, *, refuted: bool) -> PassageFindings:
    """Move all walls back until there is a way, and look where it sticks out."""

    def varied(amount: float) -> PlanningProblem:
        return replace(problem, workspace=growth.everywhere(amount))

    def improve(amount: float, trial: Trial) -> tuple[float, Trial]:
        return squeezed(varied, amount, trial, trials, _RESOLUTION)

    steps = Steps(_FIRST, _MOST_OF_REACH * problem.tree.reach, _RESOLUTION, trials=_TRIALS)
    bracket = bracketed(
        lambda amount: trials.ask(varied(amount), "moving the walls back"),
        steps,
        refuted=0.0 if refuted else None,
        improve=improve,
    )
    if bracket.found is None or bracket.trial is None:
        return PassageFindings(bracket, bare=without_walls(problem, trials))
    if bracket.trial.way is None:
        return PassageFindings(bracket)
    way = relieved(varied, bracket.trial.way, bracket.found)
    needed = max(deepest(problem.workspace, problem.tree, z) for z in way)
    growths = Growths(bracket.refuted, bracket.found, way, needed)
    passages, enough = blocking_passages(problem, growth, growths, trials)
    return PassageFindings(bracket, way, needed, tuple(passages), enough)
