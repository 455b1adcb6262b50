"""Whether the team is in its own way: the same question without walls, and with pairs that may overlap."""

from __future__ import annotations

from dataclasses import dataclass, replace

from shapely import box

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.trials import Answer, Trials

__all__ = ["WithoutWalls", "without_walls"]

_ROOM = 2.0
_PAIRS = 12


@dataclass(frozen=True)
class WithoutWalls:
    """What is known when the floor is open on all sides.

    Attributes:
        answer: The answer on the open floor.
        pairs: Pairs of bodies of which one, if it might overlap, opens a way there.
    """

    answer: Answer
    pairs: tuple[tuple[str, str], ...] = ()


def without_walls(problem: PlanningProblem, trials: Trials) -> WithoutWalls:
    """Ask on an open floor; if that has no answer either, let one pair of bodies overlap after another.

    Args:
        problem: The question.
        trials: Keeps account of the work.
    """
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    rim = _ROOM * problem.tree.reach
    bare = replace(problem, workspace=box(x_min - rim, y_min - rim, x_max + rim, y_max + rim))
    answer = trials.ask(bare, "taking the walls away").answer
    if answer is Answer.FOUND:
        return WithoutWalls(answer)
    tree, pairs = problem.tree, []
    for (i, j), (k, m) in tree.collision_pairs[:_PAIRS]:
        pair = tree.components[i].bodies[j].name, tree.components[k].bodies[m].name
        lenient = replace(bare, tree=replace(tree, sharing_joint=tree.sharing_joint | {pair}))
        if trials.ask(lenient, "letting bodies overlap").answer is Answer.FOUND:
            pairs.append(pair)
    return WithoutWalls(answer, tuple(pairs))
