"""Whether a plan holds: its cells free, its chain closed, its figures true; nothing of the search is used."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coop_drake.answers.plan import Cell, Plan
from coop_drake.answers.problem import LIMIT_ROOM, PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet
from coop_drake.verification.checks import Check, Progress, Verified
from coop_drake.verification.claims import check_claims
from coop_drake.verification.free_cells import check_apart, check_clear_of_walls
from coop_drake.verification.handovers import check_ends, check_handovers, check_nesting
from coop_drake.verification.margin import walls_to_keep_off
from coop_drake.verification.question import check_question
from coop_drake.verification.solids import Solid, colliding_pairs, team_solids
from coop_drake.verification.walls import Walls, wall_edges

__all__ = ["verify_plan"]

MARGIN_ROUNDING = 1e-6
"""A margin is kept up to so much [m]."""


def verify_plan(
    plan: Plan,
    problem: PlanningProblem,
    gain_sets: Mapping[str, GainSet],
    progress: Progress | None = None,
) -> Verified:
    """Check everything that a plan claims.

    Args:
        plan: The plan.
        problem: The question that it should answer.
        gain_sets: The scenario's gain sets by name.
        progress: Called with a phase and the share of it that is done.

    Returns:
        What was checked.

    Raises:
        RefusalError: Names the first claim that does not hold.
    """
    if len(plan.transitions) != len(plan.cells):
        raise RefusalError("transitions", f"are {len(plan.transitions)} for {len(plan.cells)} cells")
    checks = [
        check_question(plan, problem),
        _check_limits(plan, problem),
        check_nesting(plan),
        *check_handovers(plan),
        check_ends(plan, problem),
        *check_claims(plan, gain_sets),
        *_check_free(plan, problem, progress),
    ]
    return Verified("found", f"plan of {len(plan.cells)} cells", tuple(checks))


def _check_limits(plan: Plan, problem: PlanningProblem) -> Check:
    """Hold cells against the question's limits, with its room beyond those that joints start or end at."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    rooms = []
    for k, cell in enumerate(plan.cells):
        room = np.minimum(cell.lower[1:] - lower, upper - cell.upper[1:])
        if (room < 0.0).any():
            axis = int(np.argmin(room))
            raise RefusalError(
                f"cells[{k}].lower, upper",
                f"[{cell.lower[1 + axis]}, {cell.upper[1 + axis]}] on axis {1 + axis} leaves the joint's "
                f"limits [{lower[axis]}, {upper[axis]}]",
            )
        rooms.append(float(room.min(initial=np.inf)))
    name = f"joints within their limits, or the room about start and goal ({LIMIT_ROOM:g} rad or radii)"
    return Check(name, len(plan.cells) * len(lower), min(rooms), "rad or m of room")


def _check_free(
    plan: Plan, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, Check, Check]:
    """Every cell free of walls, of contacts among bodies, and its core at the margin from the walls."""
    solids, walls = team_solids(problem.tree), wall_edges(problem.workspace)
    pairs = colliding_pairs(problem.tree, solids)
    promised = walls_to_keep_off(problem, solids, walls, plan.margin)
    sums, kept, gap = 0, 0, float("inf")
    for k, cell in enumerate(plan.cells):
        sums += _clear(cell, solids, walls, f"cells[{k}]")
        gap = min([gap, *[check_apart(cell.lower, cell.upper, pair, f"cells[{k}]") for pair in pairs]])
        kept += _keeps_off(cell, solids, promised, plan.margin, f"cells[{k}]")
        if progress is not None:
            progress("checking cells", (k + 1) / len(plan.cells))
    return (
        Check("cells lie in free space: no body meets a wall anywhere in them", sums),
        Check(_apart_name(problem), len(pairs) * len(plan.cells), gap, "m, a lower bound"),
        Check("cores keep the margin", kept, plan.margin, "m"),
    )


def _apart_name(problem: PlanningProblem) -> str:
    """What is checked about contacts among bodies, and how many pairs of them are not."""
    sizes = [len(component.bodies) for component in problem.tree.components]
    moving = (sum(sizes) ** 2 - sum(size**2 for size in sizes)) // 2
    exempt = moving - len(problem.tree.collision_pairs)
    return f"bodies stay apart in every cell, {exempt} pairs aside that share a joint or are filtered"


def _clear(cell: Cell, solids: tuple[Solid, ...], walls: Walls, where: str) -> int:
    return sum(
        check_clear_of_walls(cell.safe, cell.lower, cell.upper, solid, walls, f"{where}.safe")
        for solid in solids
    )


def _keeps_off(cell: Cell, solids: tuple[Solid, ...], walls: Walls, margin: float, where: str) -> int:
    """The same for the core, with every solid grown by the margin."""
    room = max(margin - MARGIN_ROUNDING, 0.0)
    return sum(
        check_clear_of_walls(cell.core, cell.lower, cell.upper, solid, walls, f"{where}.core", room)
        for solid in solids
    )
