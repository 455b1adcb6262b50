"""Changes to the team that may make a problem feasible, each alone and by as little as is found enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import pi

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.bracket import Amounts, Bracket, bracketed
from coop_drake.diagnosis.smaller_changes import least_change
from coop_drake.diagnosis.team_changes import (
    base_bodies,
    object_bodies,
    shrink_into_themselves,
    shrunk_bodies,
    widened_joints,
)
from coop_drake.diagnosis.variants import BudgetedPlanner, Outcome
from coop_drake.tree.component_tree import ComponentTree

MOST_SHRINKAGE, SHRINKAGE_RESOLUTION = 0.7, 0.02
"""Bodies are made smaller by up to this fraction of their size, looked for this closely [-]."""

MOST_WIDENING, WIDENING_RESOLUTION = pi / 2, 0.05
"""Joint ranges are widened by up to this at either limit, looked for this closely [rad]."""

ASKED = 5
"""Amounts of one change that are tried at most [-]."""


@dataclass(frozen=True)
class TeamChange:
    """One kind of change to the team.

    Attributes:
        name: What it is called.
        unit: Unit of its amounts: ``share``, a fraction of all lengths of a body, or ``rad`` at either limit.
        tree: The team with an amount of the change.
        most: Largest amount tried.
        resolution: How closely the least amount is looked for.
        monotone: Whether what is free for an amount is free for every larger one.
    """

    name: str
    unit: str
    tree: Callable[[float], ComponentTree]
    most: float
    resolution: float
    monotone: bool = True


@dataclass(frozen=True)
class Relaxation:
    """What was computed about one change alone.

    Attributes:
        change: The change.
        bracket: Amounts proved not to be enough and found to be enough.
    """

    change: TeamChange
    bracket: Bracket

    @property
    def never_enough(self) -> bool:
        """Whether no amount up to the largest tried is enough, proved."""
        return self.change.monotone and self.bracket.is_refuted


def changes(tree: ComponentTree) -> list[TeamChange]:
    """The changes that make sense for a team."""

    def shrinking(name: str, bodies: frozenset[str]) -> TeamChange:
        return TeamChange(
            name,
            "share",
            lambda amount: shrunk_bodies(tree, bodies, 1.0 - amount),
            MOST_SHRINKAGE,
            SHRINKAGE_RESOLUTION,
            shrink_into_themselves(tree, bodies),
        )

    kinds = (("smaller bases", base_bodies(tree)), ("smaller object", object_bodies(tree)))
    listed = [shrinking(name, bodies) for name, bodies in kinds if bodies]
    if not all(joint.circular for joint in tree.joints):
        name, wider = "wider joint range", partial(widened_joints, tree)
        listed.append(TeamChange(name, "rad", wider, MOST_WIDENING, WIDENING_RESOLUTION))
    return listed


def try_changes(problem: PlanningProblem, planner: BudgetedPlanner, *, refuted: bool) -> list[Relaxation]:
    """Bracket every change alone; the largest amount comes first, as most changes do not help at all.

    ``refuted``: whether the problem was proved infeasible as it is.
    """
    return [
        Relaxation(change, _bracket(problem, change, planner, 0.0 if refuted else None))
        for change in changes(problem.tree)
    ]


def _bracket(
    problem: PlanningProblem, change: TeamChange, planner: BudgetedPlanner, refuted: float | None
) -> Bracket:
    def eased(amount: float) -> PlanningProblem:
        return replace(problem, tree=change.tree(amount))

    def improve(amount: float, outcome: Outcome) -> tuple[float, Outcome]:
        return least_change(eased, amount, outcome, planner, change.resolution)

    return bracketed(
        lambda amount: planner.ask(eased(amount), change.name),
        Amounts(change.most, change.most, change.resolution, asked=ASKED),
        refuted=refuted,
        improve=improve,
    )
