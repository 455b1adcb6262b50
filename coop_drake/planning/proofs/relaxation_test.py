"""Which relaxations are worth a proof: those for which sampling finds no path. Sampling proves nothing."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.relaxation import relaxed
from coop_drake.planning.sampling.sampler import Ladder, Sampler

_SAMPLES = 8_000
_SEED = 101


class Doubts:
    """Tries to find paths for parts of a team.

    A path answers for its robots and for fewer of them: nobody need look for a proof that there is none.

    Args:
        problem: The question.
    """

    def __init__(self, problem: PlanningProblem) -> None:
        self._problem = problem
        self._workspace = shrunk(problem.workspace, 0.0)
        self._doubted: dict[tuple[int, ...], bool] = {}

    def about(self, robots: tuple[int, ...]) -> bool:
        """Whether no path was found for the object with some robots."""
        if robots not in self._doubted:
            question, _ = relaxed(self._problem, robots)
            sampler = Sampler(Ladder(question), self._workspace, 0.0, _SEED)
            self._doubted[robots] = len(sampler.path(_SAMPLES)) == 0
        return self._doubted[robots]
