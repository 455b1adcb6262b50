"""Attempts at a channel: sampled paths that are certified, and explorations that prove."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations, islice

from shapely import MultiPolygon

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.band import drawn_tight
from coop_drake.planning.boxes import make_channel
from coop_drake.planning.cells import CellMaker, Region
from coop_drake.planning.certify import Certifier, PathBox
from coop_drake.planning.channel import Channel
from coop_drake.planning.exploration import Exploration, Verdict
from coop_drake.planning.margins import marginal_workspace, shrunk
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.refine import configuration_scale
from coop_drake.planning.relaxation import relaxed
from coop_drake.planning.sampler import Sampler

_CLEARANCE_SHARE = 1.3
_LEAST_CLEARANCE = 0.002
_SEEDS = 4
_SAMPLES = 8_000
_GAP = 0.01
_CANDIDATES = 2


Box = tuple[Intervals, Region]


class SampledAttempts:
    """Sample a path with some clearance, improve it, lay boxes along it: sound whatever was sampled.

    Args:
        problem: The question.

    Attributes:
        slices: Boxes tried along sampled paths so far.
        object_blocked: Whether the last samples found no way even for the object alone.
    """

    def __init__(self, problem: PlanningProblem) -> None:
        self._problem = problem
        self._swept = SweptTree(problem.tree)
        self._pairs = BodyPairs(self._swept)
        self._scale = configuration_scale(problem.tree)
        self._last: tuple[float, FloatArray] | None = None
        self.slices = 0
        self.object_blocked = False

    def boxes(
        self, margin: float, effort: int = 0, progress: Callable[[float], None] | None = None
    ) -> list[Box] | None:
        """Chain of boxes from start to goal whose cores keep the margin, or None if none was found.

        Args:
            margin: Margin [m].
            effort: 0 for a first try; each step up draws other samples, and twice as many.
            progress: Called with the share of a path that boxes cover.
        """
        workspace = marginal_workspace(self._problem, margin)
        certifier = Certifier(self._swept, self._pairs, workspace, self._scale, margin)
        for clearance, path in islice(self._paths(margin, effort), _CANDIDATES):
            self._last = (clearance, path)
            before = certifier.trials
            better = drawn_tight(self._problem, path, clearance, margin, _GAP)
            chain = certifier.boxes(better, progress)
            self._swept.forget()
            self.slices += certifier.trials - before
            regions = None if chain is None else self._regions(chain, workspace)
            if regions is not None:
                return regions
        return None

    def _regions(self, chain: Sequence[PathBox], workspace: MultiPolygon) -> list[Box] | None:
        """For every box all positions that are free for it and join its way's."""
        maker = CellMaker(self._swept, self._pairs, workspace)
        boxes: list[Box] = []
        for box in chain:
            regions = maker.under_cells(box.intervals)
            region = next((r for r in regions if r.depths(box.way[[0, -1]]).min() > 0.0), None)
            if region is None:
                return None
            boxes.append((box.intervals, region))
        return boxes

    def channel(self, boxes: Sequence[Box], margin: float) -> Channel:
        """Boxes with their full polygons and theta unwrapped."""
        full = CellMaker(self._swept, self._pairs, self._problem.workspace)
        angles = float(self._problem.start[2]), float(self._problem.goal_pose[2])
        return make_channel(boxes, full, margin, *angles)

    def _paths(self, margin: float, effort: int) -> Iterator[tuple[float, FloatArray]]:
        """Candidate paths with their clearance: the one that failed at a larger margin first."""
        if self._last is not None and effort == 0:
            yield self._last
        clearance = max(_CLEARANCE_SHARE * margin, _LEAST_CLEARANCE)
        workspace = marginal_workspace(self._problem, clearance)
        for seed in range(_SEEDS):
            sampler = Sampler(self._problem, workspace, _GAP, seed + _SEEDS * effort)
            path = sampler.path(_SAMPLES << effort)
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
            outcome = explorer(question).run(budget)
            slices += outcome.slices
            if outcome.verdict is Verdict.INFEASIBLE:
                return "the object " + (
                    "alone" if not chosen else f"with robots {list(chosen)} alone"
                ), slices
    return None, slices


def explorer(problem: PlanningProblem) -> Exploration:
    """An exploration by cells at margin zero: complete, and the only source of proofs."""
    swept = SweptTree(problem.tree)
    return Exploration(problem, shrunk(problem.workspace, 0.0), swept, BodyPairs(swept))
