"""Which stretches of a way must be widened, and by how much each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.growth import Growth
from coop_drake.diagnosis.passages import Stretch, stretches
from coop_drake.diagnosis.trials import Answer, Trial, Trials
from coop_drake.tree.pose import FloatArray

__all__ = ["Passage", "blocking_passages"]

_MOST = 4
_ROOMS = (1.0, 2.0, 4.0)


@dataclass(frozen=True)
class Passage:
    """A passage that blocks.

    Attributes:
        stretch: Where, what sticks out, at which angles.
        enough: How far moving its walls back was found enough, the other passages widened by theirs [m].
        refuted: How far was proved not to be enough whatever is done elsewhere up to ``enough`` there; None
            if nothing was proved [m].
    """

    stretch: Stretch
    enough: float
    refuted: float | None


@dataclass(frozen=True)
class Growths:
    """How far walls move back everywhere, as far as it is known.

    Attributes:
        refuted: Largest growth that was proved not to be enough, None if none was [m].
        enough: Growth with which a channel was found [m].
        way: A way in that channel, drawn away from the walls, shape (m, 3 + n).
        needed: How far that way sticks out of the floor as it is [m].
    """

    refuted: float | None
    enough: float
    way: FloatArray
    needed: float


def blocking_passages(
    problem: PlanningProblem, growth: Growth, everywhere: Growths, trials: Trials
) -> tuple[list[Passage], bool]:
    """Choose the stretches that have to be widened, and say by how much.

    Args:
        problem: The question with the floor as it is.
        growth: Moves walls back.
        everywhere: What is known about moving all walls back.
        trials: Keeps account of the work.

    Returns:
        The passages in the order of the way, and whether widening them alone was found enough.
    """
    found = stretches(problem, everywhere.way)
    choice = _Choice(problem, growth, everywhere, trials)
    ranked = sorted(range(len(found)), key=lambda k: (-found[k].bodies[0].depth, k))
    for count in range(1, min(len(ranked), _MOST) + 1):
        chosen = [found[k] for k in sorted(ranked[:count])]
        amounts = choice.enough(chosen)
        if amounts is not None:
            return choice.passages(chosen, amounts), True
    return [Passage(stretch, everywhere.enough, None) for stretch in found], False


class _Choice:
    """Asks about floors that are widened round some stretches only."""

    def __init__(self, problem: PlanningProblem, growth: Growth, everywhere: Growths, trials: Trials) -> None:
        self._problem, self._growth = problem, growth
        self._everywhere, self._trials = everywhere, trials

    def enough(self, chosen: Sequence[Stretch]) -> list[float] | None:
        """Amounts with which a channel is found, along the known way or anywhere; None if none are."""
        most = self._everywhere.enough
        room = most - self._everywhere.needed
        for share in _ROOMS:
            amounts = [min(most, stretch.bodies[0].depth + share * room) for stretch in chosen]
            laid = self._trials.lay(self._widened(chosen, amounts), self._everywhere.way)
            if laid.answer is Answer.FOUND:
                return amounts
        amounts = [most] * len(chosen)
        return amounts if self._ask(self._widened(chosen, amounts)).answer is Answer.FOUND else None

    def passages(self, chosen: Sequence[Stretch], amounts: Sequence[float]) -> list[Passage]:
        """The stretches that remain when those are left out that the others do without."""
        if len(chosen) == 1:
            return [Passage(chosen[0], amounts[0], self._everywhere.refuted)]
        passages = []
        for k, (stretch, amount) in enumerate(zip(chosen, amounts, strict=True)):
            others = [*chosen[:k], *chosen[k + 1 :]], [*amounts[:k], *amounts[k + 1 :]]
            answer = self._ask(self._widened(*others)).answer
            if answer is Answer.FOUND:
                return self.passages(*others)
            passages.append(Passage(stretch, amount, 0.0 if answer is Answer.INFEASIBLE else None))
        return passages

    def _ask(self, question: PlanningProblem) -> Trial:
        return self._trials.ask(question, "widening the passages")

    def _widened(self, chosen: Sequence[Stretch], amounts: Sequence[float]) -> PlanningProblem:
        zones = [(stretch.zone, amount) for stretch, amount in zip(chosen, amounts, strict=True)]
        return replace(self._problem, workspace=self._growth.around(zones))
