"""Verify a plan by sweeps and distances of its own; only data and the gain law are shared with the planner.

What a plan must show; each function raises a RefusalError at the first place where it does not hold:

1. It answers this problem: ``problem_match.check_problem``.
2. The joint intervals of its cells are within the joint limits: ``check_limits`` below.
3. The regions of every cell are nested: ``handovers.check_nesting``.
4. Consecutive cells overlap, and every transition ends in both: ``handovers.check_handovers``.
5. It begins at the start and ends at the goal within the tolerances: ``handovers.check_ends``.
6. Its stated distances, lengths and gains are right: ``figures.check_figures``.
7. At every configuration of every cell no body meets a wall, no two bodies touch, and the core keeps the
   margin: ``free_cells.check_clear_of_walls``, ``free_cells.check_apart``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import LIMIT_ROOM, PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet
from coop_drake.progress import Progress
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.figures import check_figures
from coop_drake.verification.floor_edges import floor_edges
from coop_drake.verification.free_cells import check_apart, check_clear_of_walls
from coop_drake.verification.handovers import check_ends, check_handovers, check_nesting
from coop_drake.verification.margin import edges_to_keep_clear_of
from coop_drake.verification.problem_match import check_problem
from coop_drake.verification.solids import colliding_pairs, team_solids

__all__ = ["check_limits", "verify_plan"]

MARGIN_ROUNDING = 1e-6
"""A core may miss the margin by this: more than rounding, less than any margin that matters [m]."""


def verify_plan(
    plan: Plan,
    problem: PlanningProblem,
    gain_sets: Mapping[str, GainSet],
    progress: Progress | None = None,
) -> Verified:
    """Check everything that a plan states.

    Args:
        plan: The plan.
        problem: The problem that it should solve.
        gain_sets: The scenario's gain sets by name.
        progress: Called with a phase and the fraction of it that is done.

    Returns:
        What was checked.

    Raises:
        RefusalError: Names the first statement that does not hold.
    """
    if len(plan.transitions) != len(plan.cells):
        raise RefusalError("transitions", f"are {len(plan.transitions)} for {len(plan.cells)} cells")
    checks = [
        check_problem(plan, problem),
        check_limits(plan, problem),
        check_nesting(plan),
        *check_handovers(plan),
        check_ends(plan, problem),
        *check_figures(plan, gain_sets),
        *_check_free(plan, problem, progress),
    ]
    return Verified("found", f"plan of {len(plan.cells)} cells", tuple(checks))


def check_limits(plan: Plan, problem: PlanningProblem) -> Check:
    """Check that joint intervals are within the joint limits, which are wider at a joint's start and goal."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    least = np.inf
    for k, cell in enumerate(plan.cells):
        inside = np.minimum(cell.lower[1:] - lower, upper - cell.upper[1:])
        if (inside < 0.0).any():
            axis = int(np.argmin(inside))
            raise RefusalError(
                f"cells[{k}].lower, upper",
                f"[{cell.lower[1 + axis]}, {cell.upper[1 + axis]}] on axis {1 + axis} leaves the joint's "
                f"limits [{lower[axis]}, {upper[axis]}]",
            )
        least = min(least, float(inside.min(initial=np.inf)))
    name = f"joints within their limits, or within {LIMIT_ROOM:g} rad (radii) of their start and goal"
    return Check(name, len(plan.cells) * len(lower), least, "rad or m inside")


def _check_free(
    plan: Plan, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, Check, Check]:
    """Check at every configuration of every cell that nothing touches, and that cores keep the margin."""
    solids, edges = team_solids(problem.tree), floor_edges(problem.workspace)
    pairs = colliding_pairs(problem.tree, solids)
    margin = max(plan.margin - MARGIN_ROUNDING, 0.0)
    margin_edges = edges_to_keep_clear_of(problem, solids, edges, plan.margin)
    tests, margin_tests, distance = 0, 0, float("inf")
    for k, cell in enumerate(plan.cells):
        ends, where = (cell.lower, cell.upper), f"cells[{k}]"
        for solid in solids:
            tests += check_clear_of_walls(cell.safe, *ends, solid, edges, f"{where}.safe")
        for pair in pairs:
            distance = min(distance, check_apart(*ends, pair, where))
        for solid in solids:
            margin_tests += check_clear_of_walls(
                cell.core, *ends, solid, margin_edges, f"{where}.core", margin
            )
        if progress is not None:
            progress("checking cells", (k + 1) / len(plan.cells))
    sizes = [len(component.bodies) for component in problem.tree.components]
    moving = (sum(sizes) ** 2 - sum(size**2 for size in sizes)) // 2  # Pairs of different components.
    exempt = moving - len(problem.tree.collision_pairs)
    apart = f"bodies stay apart in every cell, except {exempt} pairs that share a joint or are filtered"
    return (
        Check("cells lie in free space: no body meets a wall anywhere in them", tests),
        Check(apart, len(pairs) * len(plan.cells), distance, "m, a lower bound"),
        Check("cores keep the margin", margin_tests, plan.margin, "m"),
    )
