"""Whether a given way is free: proved by boxes laid along it, whatever the way came from."""

from __future__ import annotations

from coop_drake.answers import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes.certify import Certifier
from coop_drake.planning.questions.margins import exact_footprint, marginal_workspace
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["is_free_along"]


def is_free_along(problem: PlanningProblem, way: FloatArray) -> tuple[bool, int]:
    """Try to cover a way with free boxes, at margin zero.

    Args:
        problem: The question.
        way: Configurations from start to goal, theta unwrapped, shape (m, 3 + n) [m, rad].

    Returns:
        Whether the way is proved free (a failure proves nothing), and how many boxes were tried.
    """
    if not problem.workspace.contains(exact_footprint(problem.tree, way[0])):
        return False, 0  # Boxes tell only whether a way meets a wall, not on which side it begins.
    swept = SweptTree(problem.tree)
    try:
        workspace, scale = marginal_workspace(problem, 0.0), configuration_scale(problem.tree)
        certifier = Certifier(swept, BodyPairs(swept), workspace, scale, 0.0)
        proved = certifier.boxes(way, longest=True, smallest=True) is not None
    except GeometryError:
        return False, 0
    return proved, certifier.trials
