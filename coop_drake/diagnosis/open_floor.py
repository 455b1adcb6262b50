"""Whether the team blocks itself: the problem without walls, and with pairs of bodies that may overlap."""

from __future__ import annotations

from dataclasses import dataclass, replace

from shapely import box

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.variants import Answer, BudgetedPlanner

BEYOND = 2.0
"""The open floor extends beyond the workspace by so many times the team's reach: it can turn anywhere [-]."""

PAIRS = 12
"""Pairs of bodies that are allowed to overlap, one after another; a bound for the work [-]."""


@dataclass(frozen=True)
class OpenFloor:
    """What is known about the problem on a floor without walls.

    Attributes:
        answer: The answer there.
        pairs: Pairs of bodies; if one of these pairs might overlap, there would be a path.
    """

    answer: Answer
    pairs: tuple[tuple[str, str], ...] = ()


def on_open_floor(problem: PlanningProblem, planner: BudgetedPlanner) -> OpenFloor:
    """Ask on an open floor; if that has no path either, let one pair of bodies overlap after another."""
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    rim = BEYOND * problem.tree.reach
    bare = replace(problem, workspace=box(x_min - rim, y_min - rim, x_max + rim, y_max + rim))
    answer = planner.ask(bare, "taking the walls away").answer
    if answer is Answer.FOUND:
        return OpenFloor(answer)
    tree, pairs = problem.tree, []
    for (i, j), (k, m) in tree.collision_pairs[:PAIRS]:
        pair = tree.components[i].bodies[j].name, tree.components[k].bodies[m].name
        lenient = replace(bare, tree=replace(tree, unchecked_pairs=tree.unchecked_pairs | {pair}))
        if planner.ask(lenient, "letting bodies overlap").answer is Answer.FOUND:
            pairs.append(pair)
    return OpenFloor(answer, tuple(pairs))
