"""Explorations at margin zero, set up without the search around them."""

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.cells.exploration import Exploration
from coop_drake.planning.questions.margins import shrunk


def exploration_of(problem: PlanningProblem) -> Exploration:
    """The exploration of a whole question by cells alone."""
    swept = SweptTree(problem.tree)
    return Exploration(problem, shrunk(problem.workspace, 0.0), swept, BodyPairs(swept))
