"""An upper bound on the clearance of any path: proofs at margins above zero, for undecided questions."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.questions.margins import marginal_workspace
from coop_drake.planning.questions.relaxation import relaxed

CLEARANCES = (0.08, 0.04, 0.02, 0.01)
"""Clearances that are tried, largest first [m]."""

INSIDE_OCTAGON = 0.92
"""Workspaces are shrunk by an octagon about a disc; a disc of this fraction of the clearance has its octagon
inside the disc of the clearance, because cos(pi / 8) is 0.924 [-]."""

BUDGET = 128
"""Slices of each exploration: enough for a clear case, and little beside the search that went before."""


def clearance_bound(problem: PlanningProblem) -> tuple[float | None, int]:
    """The smallest of some clearances of which it is proved that no path keeps it from the walls.

    The proofs are for the object with at most one robot. The start and the goal may stand closer to a wall:
    near them the clearance is not required.

    Returns:
        The clearance [m], None if none was refuted, and the slices made for the proofs.
    """
    bound, slices = None, 0
    parts: list[tuple[int, ...]] = [(), *[(r,) for r in sorted({j.robot for j in problem.tree.joints})]]
    for clearance in CLEARANCES:
        refuted = False
        for chosen in parts:
            question, _ = relaxed(problem, chosen)
            try:
                workspace = marginal_workspace(problem, INSIDE_OCTAGON * clearance)
            except GeometryError:
                return bound, slices
            outcome = Exploration(question, workspace).run(BUDGET)
            slices += outcome.slices
            refuted = outcome.verdict is Verdict.INFEASIBLE
            if refuted:
                parts = [chosen, *[part for part in parts if part != chosen]]
                break
        if not refuted:
            return bound, slices
        bound = clearance
    return bound, slices
