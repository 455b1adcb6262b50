"""Changes to the team that may make a question feasible, each by as little as is found enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.bracket import Bracket, Steps, bracketed
from coop_drake.diagnosis.squeeze import squeezed
from coop_drake.diagnosis.team_changes import (
    base_bodies,
    object_bodies,
    shrink_into_themselves,
    shrunk_bodies,
    widened_joints,
)
from coop_drake.diagnosis.trials import Trial, Trials
from coop_drake.tree.component_tree import ComponentTree

__all__ = ["Change", "Relaxation", "changes", "try_changes"]

_MOST_SHRINKAGE = 0.7
_SHRINKAGE_RESOLUTION = 0.02
_MOST_WIDENING = pi / 2
_WIDENING_RESOLUTION = 0.05
_TRIALS = 5


@dataclass(frozen=True)
class Change:
    """One kind of change to the team.

    Attributes:
        name: What it is called.
        unit: What its amounts count: ``share`` of all lengths of a body, or ``rad`` at either limit.
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
    """What was computed about one kind of change alone.

    Attributes:
        change: The change.
        bracket: Amounts proved not to be enough and found to be enough.
    """

    change: Change
    bracket: Bracket

    @property
    def never_enough(self) -> bool:
        """Whether no amount up to the largest tried is enough, proved."""
        return self.change.monotone and self.bracket.is_refuted


def changes(tree: ComponentTree) -> list[Change]:
    """The changes that make sense for a team."""
    bases, carried = base_bodies(tree), object_bodies(tree)

    def shrinking(name: str, bodies: frozenset[str]) -> Change:
        return Change(
            name,
            "share",
            lambda a: shrunk_bodies(tree, bodies, 1.0 - a),
            _MOST_SHRINKAGE,
            _SHRINKAGE_RESOLUTION,
            shrink_into_themselves(tree, bodies),
        )

    listed = [shrinking("smaller bases", bases)] if bases else []
    listed += [shrinking("smaller object", carried)] if carried else []
    if tree.joints:
        wider = Change(
            "wider joint range",
            "rad",
            lambda a: widened_joints(tree, a),
            _MOST_WIDENING,
            _WIDENING_RESOLUTION,
        )
        listed.append(wider)
    return listed


def try_changes(problem: PlanningProblem, trials: Trials, *, refuted: bool) -> list[Relaxation]:
    """Bracket every change alone; the largest amount comes first, as most changes do not help at all.

    Args:
        problem: The question as it is.
        trials: Keeps account of the work.
        refuted: Whether it was proved infeasible as it is.
    """
    return [
        Relaxation(change, _bracket(problem, change, trials, 0.0 if refuted else None))
        for change in changes(problem.tree)
    ]


def _bracket(problem: PlanningProblem, change: Change, trials: Trials, refuted: float | None) -> Bracket:
    def varied(amount: float) -> PlanningProblem:
        return replace(problem, tree=change.tree(amount))

    def improve(amount: float, trial: Trial) -> tuple[float, Trial]:
        return squeezed(varied, amount, trial, trials, change.resolution)

    steps = Steps(change.most, change.most, change.resolution, trials=_TRIALS)
    return bracketed(
        lambda amount: trials.ask(varied(amount), change.name), steps, refuted=refuted, improve=improve
    )
