"""Attempts at a channel: sampled paths that are certified, and explorations that prove."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations, islice

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.band import configuration_scale, drawn_tight
from coop_drake.planning.cells import CellMaker
from coop_drake.planning.certify import Box, Certifier
from coop_drake.planning.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.margins import marginal_workspace, shrunk
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.relaxation import relaxed
from coop_drake.planning.sampler import Sampler

Count = Callable[[int], None]
_CLEARANCE_SHARE = 1.3
_LEAST_CLEARANCE = 0.002
_SEEDS = 4
_SAMPLES = 8_000
_GAP = 0.01
_CANDIDATES = 2


class SampledAttempts:
    """Sample a path with some clearance, improve it, lay boxes along it: sound whatever was sampled.

    Args:
        problem: The question.
        swept: Sweeps of its tree.
        pairs: Self-collision of its tree.
    """

    def __init__(self, problem: PlanningProblem, swept: SweptTree, pairs: BodyPairs) -> None:
        self._problem, self._swept, self._pairs = problem, swept, pairs
        self._scale = configuration_scale(problem)
        self._last: tuple[float, FloatArray] | None = None
        self.object_blocked = False

    def boxes(self, margin: float) -> list[Box] | None:
        """Chain of boxes from start to goal whose cores keep the margin, or None if none was found."""
        maker = CellMaker(self._swept, self._pairs, marginal_workspace(self._problem, margin))
        certifier = Certifier(self._problem.tree, maker, self._scale, margin)
        for clearance, path in islice(self._paths(margin), _CANDIDATES):
            self._last = (clearance, path)
            better = drawn_tight(self._problem, path, clearance, margin, _GAP)
            chain = certifier.boxes(better)
            self._swept.forget()
            if chain is not None:
                return chain
        return None

    def _paths(self, margin: float) -> Iterator[tuple[float, FloatArray]]:
        """Candidate paths with their clearance: the one that failed at a larger margin first."""
        if self._last is not None:
            yield self._last
        clearance = max(_CLEARANCE_SHARE * margin, _LEAST_CLEARANCE)
        workspace = marginal_workspace(self._problem, clearance)
        for seed in range(_SEEDS):
            sampler = Sampler(self._problem, workspace, _GAP, seed)
            path = sampler.path(_SAMPLES)
            self.object_blocked = sampler.stages == 0
            if len(path):
                yield clearance, path
            if self.object_blocked:
                return


def refuted_relaxation(problem: PlanningProblem, budget: int) -> tuple[str | None, int]:
    """Look for a proof of infeasibility with some of the robots left out.

    Args:
        problem: The question, whose margin is zero.
        budget: Slices that each relaxation may make.

    Returns:
        What is infeasible, in words, or None; and the slices made.
    """
    robots = sorted({joint.robot for joint in problem.tree.joints})
    slices = 0
    for count in range(len(robots)):
        for chosen in combinations(robots, count):
            question, _ = relaxed(problem, chosen)
            outcome = explore(question, budget, None)[1]
            slices += outcome.slices
            if outcome.verdict is Verdict.INFEASIBLE:
                return "the object " + (
                    "alone" if not chosen else f"with robots {list(chosen)} alone"
                ), slices
    return None, slices


def explore(problem: PlanningProblem, budget: int, progress: Count | None) -> tuple[Exploration, Outcome]:
    """Explore by cells at margin zero: complete, and the only source of proofs."""
    swept = SweptTree(problem.tree)
    exploration = Exploration(problem, shrunk(problem.workspace, 0.0), swept, BodyPairs(swept))
    return exploration, exploration.run(budget, progress)
