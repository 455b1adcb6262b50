"""The relaxation test: which relaxations are worth a proof, because sampling finds no path for them."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.relaxation import relaxed
from coop_drake.planning.sampling.sampler import Sampler
from coop_drake.planning.sampling.subsystems import SubsystemHierarchy

SAMPLES = 8_000
"""Samples for every subsystem: twice those of a first attempt, because a failure costs an exploration."""

SEED = 101
"""Seed of the samples, other than those of the search, which have failed already."""


class RelaxationTest:
    """Tests by sampling whether a part of the team has a path; a path makes a proof for that part impossible.

    Args:
        problem: The question.
    """

    def __init__(self, problem: PlanningProblem) -> None:
        self._problem = problem
        self._workspace = shrunk(problem.workspace, 0.0)
        self._failed: dict[tuple[int, ...], bool] = {}

    def finds_no_path(self, robots: tuple[int, ...]) -> bool:
        """Whether sampling finds no path for the object with some robots, which proves nothing."""
        if robots not in self._failed:
            question, _ = relaxed(self._problem, robots)
            sampler = Sampler(SubsystemHierarchy(question), self._workspace, 0.0, SEED)
            self._failed[robots] = len(sampler.path(SAMPLES)) == 0
        return self._failed[robots]
