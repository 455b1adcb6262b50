"""A proof that a given path of the whole team is free."""

from __future__ import annotations

from coop_drake.answers import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes import Certifier
from coop_drake.planning.questions import exact_footprint, marginal_workspace
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray


def is_free(problem: PlanningProblem, path: FloatArray) -> tuple[bool, int]:
    """Try to prove a path free at margin zero, by covering it with free boxes.

    The path, circular axes unwrapped, has shape (m, 3 + n) [m, rad].

    Returns:
        Whether the path is proved free (a failure proves nothing), and how many boxes were tried.
    """
    if not problem.workspace.contains(exact_footprint(problem.tree, path[0])):
        return False, 0  # Boxes show that a path meets no wall, but not on which side of it the path begins.
    swept = SweptTree(problem.tree)
    try:
        workspace, scale = marginal_workspace(problem, 0.0), configuration_scale(problem.tree)
        certifier = Certifier(swept, BodyPairs(swept), workspace, scale, 0.0)
        proved = certifier.boxes(path, longest=True, smallest=True) is not None
    except GeometryError:
        return False, 0
    return proved, certifier.trials
