"""The diagnosis: plan; move the walls back until there is a path; see where it collides; change the team."""

from __future__ import annotations

from dataclasses import replace

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.bracket import Amounts, bracketed
from coop_drake.diagnosis.contacts import deepest
from coop_drake.diagnosis.findings import Diagnosis, PassageFindings
from coop_drake.diagnosis.goal_collision import blocked_pose
from coop_drake.diagnosis.open_floor import on_open_floor
from coop_drake.diagnosis.passages import UniformWidening, blocking_passages
from coop_drake.diagnosis.relaxations import try_changes
from coop_drake.diagnosis.smaller_changes import clear_elsewhere, least_change
from coop_drake.diagnosis.variants import Answer, BudgetedPlanner, Outcome
from coop_drake.diagnosis.widened_floor import WidenedFloor
from coop_drake.planning import Channel, find_channel
from coop_drake.progress import Progress

SLICES = 120
"""Budget of every variant [slices]: most have their answer within some dozens."""

TOTAL = 30_000
"""Budget of a whole diagnosis [slices]: some minutes."""

FIRST = 0.05
"""First distance by which the walls are moved back [m]."""

LARGEST = 0.5
"""Largest distance by which the walls are moved back, in units of the team's reach [-]."""

RESOLUTION = 0.0025
"""The distance is bracketed to this [m]."""

ASKED = 6
"""Distances that are tried at most [-]."""


def diagnose(problem: PlanningProblem, progress: Progress | None = None) -> Diagnosis:
    """Say why no plan exists or none was found, and what would help; the same for the same problem.

    Amounts of a change that are too little rest on proofs of the planner, amounts that are enough on channels
    that it proved free. What is said about bodies and angles is read off one path and proves nothing.
    """
    answer, report = find_channel(problem, progress)
    if isinstance(answer, Channel):
        return Diagnosis(Answer.FOUND, "", slices=report.slices)
    planner = BudgetedPlanner(SLICES, TOTAL, progress)
    known = Answer.INFEASIBLE if answer.proved else Answer.UNDECIDED
    made = Diagnosis(known, answer.reason, mixed=answer.mixed)
    floor = WidenedFloor(problem.workspace, problem.start[:2], LARGEST * problem.tree.reach)
    if answer.proof is not None and answer.proof.kind == "blocked goal":
        made = replace(made, goal=blocked_pose(problem, floor, planner))
    else:
        made = replace(made, passages=find_passages(problem, floor, planner, refuted=answer.proved))
    relaxations = tuple(try_changes(problem, planner, refuted=answer.proved))
    return replace(made, relaxations=relaxations, slices=report.slices + planner.spent)


def find_passages(
    problem: PlanningProblem, floor: WidenedFloor, planner: BudgetedPlanner, *, refuted: bool
) -> PassageFindings:
    """Move all walls back until there is a path, and find where that path leaves the original floor.

    ``refuted``: whether the problem was proved infeasible as it is.
    """

    def eased(amount: float) -> PlanningProblem:
        return replace(problem, workspace=floor.everywhere(amount))

    def improve(amount: float, outcome: Outcome) -> tuple[float, Outcome]:
        return least_change(eased, amount, outcome, planner, RESOLUTION)

    bracket = bracketed(
        lambda amount: planner.ask(eased(amount), "moving the walls back"),
        Amounts(FIRST, floor.most, RESOLUTION, asked=ASKED),
        refuted=0.0 if refuted else None,
        improve=improve,
    )
    if bracket.found is None or bracket.outcome is None:
        return PassageFindings(bracket, open_floor=on_open_floor(problem, planner))
    if bracket.outcome.path is None:
        return PassageFindings(bracket)
    path = clear_elsewhere(eased, bracket.outcome.path, bracket.found)
    needed = max(deepest(problem.workspace, problem.tree, z) for z in path)
    everywhere = UniformWidening(bracket.refuted, bracket.found, path, needed)
    passages, enough = blocking_passages(problem, floor, everywhere, planner)
    return PassageFindings(bracket, path, needed, tuple(passages), enough)
