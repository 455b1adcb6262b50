"""Varied questions put to the planner, within a budget of work, each answered in one of three ways."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.along import is_free_along
from coop_drake.diagnosis.way import path_through
from coop_drake.errors import GeometryError
from coop_drake.planning import Channel
from coop_drake.planning.boxes.boxes import explored_channel
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.proofs.proofs import Proofs
from coop_drake.planning.sampling.sampler import densified
from coop_drake.planning.search.sampled_search import SampledSearch
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["Answer", "Trial", "Trials"]

_STEP = 0.05
_PATHS = 2
_BOXES_PER_SLICE = 20

Progress = Callable[[str, float], None]


class Answer(Enum):
    """What is known about a question."""

    FOUND = "found"
    INFEASIBLE = "infeasible"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Trial:
    """One question and its answer.

    Attributes:
        problem: The question.
        answer: What was computed; INFEASIBLE is a proof.
        way: Configurations from start to goal that are proved free, shape (m, 3 + n); None if there are none.
    """

    problem: PlanningProblem
    answer: Answer
    way: FloatArray | None = None


class Trials:
    """Asks the planner at margin zero, and keeps account of the work.

    Args:
        slices: Budget of each search, in slices.
        total: Budget of all searches together, in slices; when it is spent everything is undecided.
        progress: Called with a stage and the share of the total budget that is spent.
    """

    def __init__(self, slices: int, total: int, progress: Progress | None = None) -> None:
        self._slices, self._total, self._progress = slices, total, progress
        self.asked, self.spent = 0, 0

    def ask(self, problem: PlanningProblem, stage: str) -> Trial:
        """Ask for a channel.

        Args:
            problem: The question; its margin and its budget of slices are set here.
            stage: What this is done for, in a few words.
        """
        self._tell(stage)
        if self.spent >= self._total:
            return Trial(problem, Answer.UNDECIDED)
        self.asked += 1
        question = replace(problem, settings=replace(problem.settings, margin=0.0, max_slices=self._slices))
        samples, proofs = SampledSearch(question), Proofs(question)
        trial = self._asked(question, samples, proofs, stage)
        self.spent += max(1, samples.slices // _BOXES_PER_SLICE + proofs.slices)
        return trial

    def _asked(self, question: PlanningProblem, samples: SampledSearch, proofs: Proofs, stage: str) -> Trial:
        """Sample some paths and explore once: a part of what the planner does, hence as sound."""
        for _ in range(_PATHS):
            found = samples.attempt(lambda _: self._tell(stage))
            if found is not None:
                way = densified(found.path, configuration_scale(question.tree), _STEP)
                return Trial(question, Answer.FOUND, way)
        verdict = proofs.run(self._slices, progress=lambda _: self._tell(stage))
        if verdict is Verdict.INFEASIBLE:
            return Trial(question, Answer.INFEASIBLE)
        if verdict is Verdict.FOUND:
            return Trial(
                question, Answer.FOUND, self._way(question, explored_channel(question, proofs.boxes()))
            )
        return Trial(question, Answer.UNDECIDED)

    @staticmethod
    def _way(problem: PlanningProblem, channel: Channel) -> FloatArray | None:
        try:
            return path_through(problem, channel, _STEP)
        except GeometryError:  # A cell with a cusp: the channel is proved all the same.
            return None

    def lay(self, problem: PlanningProblem, way: FloatArray) -> Trial:
        """Prove a given way free; a failure proves nothing."""
        free, tried = is_free_along(problem, way)
        self.spent += tried // _BOXES_PER_SLICE
        return Trial(problem, Answer.FOUND if free else Answer.UNDECIDED, way if free else None)

    def _tell(self, stage: str) -> None:
        if self._progress is not None:
            self._progress(stage, min(1.0, self.spent / self._total))
