"""Proofs on large floors from the walls near the goal or the start alone: all else counts as free."""

from __future__ import annotations

from dataclasses import replace

import shapely
from shapely import Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.cells.events import Watch
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.proofs.proof_search import Proofs, Refutation
from coop_drake.tree.pose import FloatArray

MANY_CORNERS = 300
"""On floors with fewer corners [-] the question is explored as it is."""

REACHES = 8.0
"""Walls count up to so many reaches of the team from the goal or start, along x and along y [-]."""

OVERLAP = 1e-3
"""What counts as free overlaps that part of the floor by this many reaches [-], so that rounding puts no wall
between them."""

BEYOND = 4.0
"""It extends so many reaches beyond the floor [-]: no piece of a team off the floor is inside it."""

SLICES = 250
"""Slices of each exploration: a second of work."""

FEW_ROBOTS = 1
"""Robots that are kept in the first explorations."""


def refuted_at_an_end(problem: PlanningProblem, watch: Watch | None = None) -> tuple[Refutation | None, int]:
    """Look for a proof that the team cannot leave the start, or reach the goal, for walls near it.

    What is proved on a floor that holds the question's floor is proved for the question.

    Args:
        problem: The question.
        watch: Called with the events of explorations.

    Returns:
        The proof, None if there is none or the floor is small, and the slices made.
    """
    slices = 0
    if shapely.get_num_coordinates(problem.workspace) < MANY_CORNERS:
        return None, 0
    for end in (problem.goal_pose[:2], problem.start[:2]):
        question = _opened(problem, end)
        proofs = None if question is None else Proofs(question, watch)
        if proofs is None:
            continue
        for robots in (FEW_ROBOTS, None):
            if proofs.run(SLICES, robots) in (Verdict.FOUND, Verdict.INFEASIBLE):
                break
        slices += proofs.slices
        if proofs.refutation is not None:
            return proofs.refutation, slices
    return None, slices


def _opened(problem: PlanningProblem, centre: FloatArray) -> PlanningProblem | None:
    """The question with a floor that has walls near a point only; None if geometry fails."""
    (x, y), reach = centre, problem.tree.reach
    near, inner = (
        shapely.box(x - half, y - half, x + half, y + half)
        for half in (REACHES * reach, (REACHES - OVERLAP) * reach)
    )
    ends = shapely.MultiPoint([problem.start[:2], problem.goal_pose[:2]])
    hull = shapely.union_all([problem.workspace.envelope, near, ends]).envelope
    try:
        outside = hull.buffer(BEYOND * reach, join_style="mitre").difference(inner)
        floor = problem.workspace.intersection(near).union(outside)
    except ShapelyError:
        return None
    return replace(problem, workspace=floor) if isinstance(floor, Polygon) else None
