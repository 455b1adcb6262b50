"""How much room a way can have at most: proofs at margins above zero, for questions that stay undecided."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.questions.margins import marginal_workspace
from coop_drake.planning.questions.relaxation import relaxed

CLEARANCES = (0.08, 0.04, 0.02, 0.01)
"""Clearances that are tried, largest first [m]."""

_OCTAGON = 0.92  # Workspaces are shrunk by an octagon that reaches 1 / cos(pi / 8) as far as the disc in it.
_BUDGET = 128


def clearance_bound(problem: PlanningProblem) -> tuple[float | None, int]:
    """Least of some clearances that no way keeps from the walls, proved for the object with one robot.

    Start and goal may stand closer to a wall themselves: near them the clearance is not asked for.

    Args:
        problem: The question.

    Returns:
        The clearance [m], None if none was refuted, and the slices made for it.
    """
    bound, slices = None, 0
    parts: list[tuple[int, ...]] = [(), *[(r,) for r in sorted({j.robot for j in problem.tree.joints})]]
    for clearance in CLEARANCES:
        refuted = False
        for chosen in parts:
            question, _ = relaxed(problem, chosen)
            swept = SweptTree(question.tree)
            try:
                workspace = marginal_workspace(problem, _OCTAGON * clearance)
            except GeometryError:
                return bound, slices
            outcome = Exploration(question, workspace, swept, BodyPairs(swept)).run(_BUDGET)
            slices += outcome.slices
            refuted = outcome.verdict is Verdict.INFEASIBLE
            if refuted:
                parts = [chosen, *[part for part in parts if part != chosen]]
                break
        if not refuted:
            return bound, slices
        bound = clearance
    return bound, slices
