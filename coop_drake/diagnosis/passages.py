"""Which passages must be widened, and each by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.path_collisions import CollidingStretch, colliding_stretches
from coop_drake.diagnosis.variants import Answer, BudgetedPlanner
from coop_drake.diagnosis.widened_floor import WidenedFloor
from coop_drake.tree.pose import FloatArray

MOST = 4
"""Passages that are widened together at most [-]."""

SLACKS = (1.0, 2.0, 4.0)
"""Amounts tried beyond what the path needs in a passage, in units of the slack that it has everywhere [-]."""


@dataclass(frozen=True)
class BlockingPassage:
    """A passage that blocks.

    Attributes:
        stretch: The stretch of the path in it: where, which bodies collide, at which angles.
        enough: A distance of moving its walls back with which a channel was found, the other passages widened
            by theirs [m].
        refuted: A distance that was proved not to be enough, whatever is done elsewhere up to ``enough``
            there; None if nothing was proved [m].
    """

    stretch: CollidingStretch
    enough: float
    refuted: float | None


@dataclass(frozen=True)
class UniformWidening:
    """What is known about moving all walls back by one distance.

    Attributes:
        refuted: Largest distance that was proved not to be enough, None if none was [m].
        enough: A distance with which a channel was found [m].
        path: A path in that channel, away from the walls where it can be, shape (m, 3 + n).
        needed: How far that path leaves the floor as it is [m].
    """

    refuted: float | None
    enough: float
    path: FloatArray
    needed: float


def blocking_passages(
    problem: PlanningProblem, floor: WidenedFloor, everywhere: UniformWidening, planner: BudgetedPlanner
) -> tuple[list[BlockingPassage], bool]:
    """Choose the passages that have to be widened, and say by how much.

    Those in which the path leaves the floor most are widened first, until a channel is found.

    Returns:
        The passages in the order of the path, and whether a channel was found with only these widened.
    """
    found = colliding_stretches(problem, everywhere.path)
    choice = _Choice(problem, floor, everywhere, planner)
    ranked = sorted(range(len(found)), key=lambda k: (-found[k].bodies[0].depth, k))
    for count in range(1, min(len(ranked), MOST) + 1):
        chosen = [found[k] for k in sorted(ranked[:count])]
        amounts = choice.enough(chosen)
        if amounts is not None:
            return choice.needed(chosen, amounts), True
    return [BlockingPassage(stretch, everywhere.enough, None) for stretch in found], False


@dataclass(frozen=True)
class _Choice:
    """Asks about floors that are widened around some stretches only."""

    problem: PlanningProblem
    floor: WidenedFloor
    everywhere: UniformWidening
    planner: BudgetedPlanner

    def enough(self, chosen: Sequence[CollidingStretch]) -> list[float] | None:
        """Amounts with which a channel is found, along the known path or anywhere; None if none are."""
        most = self.everywhere.enough
        slack = most - self.everywhere.needed
        for factor in SLACKS:
            amounts = [min(most, stretch.bodies[0].depth + factor * slack) for stretch in chosen]
            outcome = self.planner.prove(self._widened(chosen, amounts), self.everywhere.path)
            if outcome.answer is Answer.FOUND:
                return amounts
        amounts = [most] * len(chosen)
        return amounts if self._ask(chosen, amounts) is Answer.FOUND else None

    def needed(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> list[BlockingPassage]:
        """The passages without those that need no widening once the others are widened."""
        if len(chosen) == 1:
            return [BlockingPassage(chosen[0], amounts[0], self.everywhere.refuted)]
        passages = []
        for k, (stretch, amount) in enumerate(zip(chosen, amounts, strict=True)):
            others = [*chosen[:k], *chosen[k + 1 :]], [*amounts[:k], *amounts[k + 1 :]]
            answer = self._ask(*others)
            if answer is Answer.FOUND:
                return self.needed(*others)
            passages.append(BlockingPassage(stretch, amount, 0.0 if answer is Answer.INFEASIBLE else None))
        return passages

    def _ask(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> Answer:
        return self.planner.ask(self._widened(chosen, amounts), "widening the passages").answer

    def _widened(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> PlanningProblem:
        zones = [(stretch.zone, amount) for stretch, amount in zip(chosen, amounts, strict=True)]
        return replace(self.problem, workspace=self.floor.around(zones))
