"""Variants of the problem, put to the planner within a budget of work; each has one of three answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.paths import is_free
from coop_drake.errors import GeometryError, PlanError
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.channel import ended, make_channel
from coop_drake.planning.proofs import Proofs
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.collision import densified
from coop_drake.planning.transitions import path_through
from coop_drake.progress import Progress
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

STEP = 0.05
"""Distance of consecutive configurations of the paths that are looked at [m]."""

PATHS = 2
"""Paths that are sampled for a variant before it is explored for a proof [-]."""

BOXES_PER_SLICE = 20
"""Boxes whose certification takes about as long as sweeping one slice [-]."""


class Answer(Enum):
    """What is known about a problem."""

    FOUND = "found"
    INFEASIBLE = "infeasible"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Outcome:
    """A variant and its answer.

    Attributes:
        problem: The variant.
        answer: What was computed; INFEASIBLE is a proof.
        path: Configurations from start to goal that are proved free, shape (m, 3 + n); None if there are
            none.
    """

    problem: PlanningProblem
    answer: Answer
    path: FloatArray | None = None


class BudgetedPlanner:
    """Asks the planner at margin zero and counts the work, so that a diagnosis ends.

    Args:
        slices: Budget of each search, in slices.
        total: Budget of all searches together, in slices; when it is spent everything is undecided.
        progress: Called with a stage and the fraction of the total budget that is spent.
    """

    def __init__(self, slices: int, total: int, progress: Progress | None = None) -> None:
        self._slices, self._total, self._progress = slices, total, progress
        self.spent = 0

    def ask(self, problem: PlanningProblem, stage: str) -> Outcome:
        """Sample some paths and explore once: a part of what the planner does, hence as sound.

        The variant's margin and its budget of slices are set here. The stage says what this is done for.
        """
        self._report(stage)
        if self.spent >= self._total:
            return Outcome(problem, Answer.UNDECIDED)
        settings = replace(problem.settings, margin=0.0, max_slices=self._slices)
        variant = replace(problem, settings=settings)
        samples, proofs = SampledSearch(variant), Proofs(variant)
        outcome = self._asked(variant, samples, proofs, stage)
        self.spent += max(1, samples.slices // BOXES_PER_SLICE + proofs.slices)
        return outcome

    def _asked(self, variant: PlanningProblem, samples: SampledSearch, proofs: Proofs, stage: str) -> Outcome:
        for _ in range(PATHS):
            (tried,) = samples.attempts(1, progress=lambda _: self._report(stage))
            found = samples.taken(tried)
            if found is not None:
                path = densified(found.path, configuration_scale(variant.tree), STEP)
                return Outcome(variant, Answer.FOUND, path)
        verdict = proofs.run(self._slices, progress=lambda _: self._report(stage))
        if verdict is Verdict.INFEASIBLE:
            return Outcome(variant, Answer.INFEASIBLE)
        if verdict is not Verdict.FOUND:
            return Outcome(variant, Answer.UNDECIDED)
        try:
            channel = make_channel(variant, proofs.boxes(), 0.0, None)
            path = path_through(ended(variant, channel), channel)
        except (GeometryError, PlanError):  # A cell with a cusp: the channel is proved free all the same.
            return Outcome(variant, Answer.FOUND)
        return Outcome(variant, Answer.FOUND, densified(path, configuration_scale(variant.tree), STEP))

    def prove(self, problem: PlanningProblem, path: FloatArray) -> Outcome:
        """Try to prove a given path free in a variant; a failure proves nothing."""
        free, tried = is_free(problem, path)
        self.spent += tried // BOXES_PER_SLICE
        return Outcome(problem, Answer.FOUND if free else Answer.UNDECIDED, path if free else None)

    def _report(self, stage: str) -> None:
        if self._progress is not None:
            self._progress(stage, min(1.0, self.spent / self._total))
