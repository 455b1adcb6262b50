"""Search by sampled paths: a path is sampled, smoothed and covered with boxes that are proved free."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes.boxes import Regions, make_channel
from coop_drake.planning.boxes.certify import Certifier
from coop_drake.planning.boxes.channel import Channel, CoveredPath
from coop_drake.planning.questions.margins import exact_footprint, marginal_workspace
from coop_drake.planning.sampling.clear_paths import (
    another_candidate,
    best_candidate,
    margins_to_try,
    moved_from_obstacles,
)
from coop_drake.planning.sampling.elastic_band import smoothed
from coop_drake.planning.sampling.guided_samples import GuidePath
from coop_drake.planning.sampling.sampler import FEW_JOINTS, Sampler
from coop_drake.planning.sampling.subsystems import SubsystemHierarchy
from coop_drake.planning.search.attempt import LIGHT_ATTEMPTS, BoxSequence, Tried, samples_of_attempt
from coop_drake.planning.search.narrow_search import BODY_GAP, NarrowSearch
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

CLEARANCES = (0.015, 0.01), (0.002, 0.002)
"""Clearances from the walls, and distances between bodies of the team, with which paths are sampled, in turns
[m]: the larger ones leave space for long boxes, the smaller ones let narrow passages through."""

FIRST_SMOOTHINGS = (0.05, 600), (0.05, 3_000)
"""Spacing of samples [m] and number of moves with which a new path is smoothed; the longer smoothing follows
only if boxes cannot cover the path after the shorter one."""


class SampledSearch:
    """Finds a box sequence at margin zero first, then looks for a larger margin near it.

    What it finds is proved by the boxes, whatever was sampled. If it finds nothing, that is no proof.

    Args:
        problem: The question.
        route: A route for a disc inside the object, around which paths are sampled, shape (k, 2) [m]; None:
            the disc's path is sampled, too.

    Attributes:
        slices: Boxes tried so far.
        object_blocked: Number of attempts in a row in which no path was found even for the object alone.
    """

    def __init__(self, problem: PlanningProblem, route: FloatArray | None = None) -> None:
        self._problem = problem
        self._swept = SweptTree(problem.tree)
        self._pairs = BodyPairs(self._swept)
        self._scale = configuration_scale(problem.tree)
        self._hierarchy = SubsystemHierarchy(problem, route)
        self._narrow = NarrowSearch(problem, self._hierarchy, self._closely)
        self._start_inside = problem.workspace.contains(exact_footprint(problem.tree, problem.start))
        self._attempts = 0
        self.slices = 0
        self.object_blocked = 0

    def attempts(
        self,
        number: int,
        progress: Callable[[float], None] | None = None,
        part: tuple[int, ...] | None = None,
    ) -> Iterator[Tried]:
        """Sample some paths and cover each of them at margin zero, all with other samples.

        Args:
            number: How many.
            progress: Called with the fraction of an attempt that is done.
            part: Robots for which, with the object alone, a path seems hard to find: it is sampled first.

        Returns:
            What comes of the attempts, each made when it is asked for; ``taken`` counts it.
        """
        first = self._attempts + 1
        works = [partial(self._attempt, k, progress, part=part) for k in range(first, first + number)]
        return map(self._counted, works)

    def taken(self, tried: Tried) -> BoxSequence | None:
        """Count an attempt; returns its boxes, None if no path was found or covered."""
        self._attempts += 1
        self.slices += tried.trials
        if tried.blocked is not None:
            self.object_blocked = self.object_blocked + 1 if tried.blocked else 0
        return tried.found

    def _counted(self, work: Callable[[], Tried]) -> Tried:
        """What comes of some work, with the boxes that it tried; nothing else changes here."""
        before = self.slices
        try:
            tried = work()
        except (GeometryError, ShapelyError):
            tried = Tried(failed=True)
        trials, self.slices = self.slices - before, before
        return replace(tried, trials=trials)

    def around(self, guide: FloatArray) -> BoxSequence | None:
        """Sample paths around another one, which need not be free, and cover them at margin zero.

        Args:
            guide: Configurations, circular axes unwrapped, shape (m, 3 + n) [m, rad].

        Returns:
            The boxes, or None if no path was found or covered.
        """
        for number in range(LIGHT_ATTEMPTS + 1, LIGHT_ATTEMPTS + 1 + len(CLEARANCES)):
            tried = self._counted(partial(self._attempt, number, None, guide))
            self.slices += tried.trials
            if tried.found is not None:
                return tried.found
        return None

    def _attempt(
        self,
        number: int,
        progress: Callable[[float], None] | None,
        guide: FloatArray | None = None,
        part: tuple[int, ...] | None = None,
    ) -> Tried:
        if not self._start_inside:
            return Tried()
        clearance, gap = CLEARANCES[(number - 1) % len(CLEARANCES)]
        workspace = marginal_workspace(self._problem, clearance)
        sampler = Sampler(self._hierarchy, workspace, gap, number - 1, progress)
        direct = number > 1 or len(self._problem.goal_joints) > FEW_JOINTS
        samples = samples_of_attempt(number)
        if guide is None:
            # Samples anywhere take as long as all others, and hardly ever help where these did not.
            path = (
                sampler.direct_path(samples, part, anywhere=number > 1) if direct else sampler.path(samples)
            )
        else:
            joints = tuple(range(guide.shape[1] - 3))
            path = sampler.path_around(GuidePath(guide, joints), samples)
        found = None
        for spacing, moves in FIRST_SMOOTHINGS if len(path) else ():
            path = smoothed(self._problem, path, clearance, 0.0, gap, spacing, moves)
            found = self._covered(path, 0.0, longest=True)
            if found is not None:
                break
        return Tried(found, path, sampler.object_blocked)

    def narrow_attempt(
        self,
        number: int,
        progress: Callable[[float], None] | None = None,
        *,
        object_first: bool = False,
    ) -> BoxSequence | None:
        """Look for a path through passages that are too narrow for samples, and cover it at margin zero.

        Args:
            number: How many such attempts there were before.
            progress: Called with the fraction of an attempt that is done.
            object_first: Whether a path of the object alone is to be found before one of the team.

        Returns:
            The boxes, or None if no path was found or covered.
        """
        if not self._start_inside:
            return None
        done: list[Tried] = []
        for one in self._narrow.tries(number, progress, object_first=object_first):
            tried = self._counted(one)
            self.slices += tried.trials
            if tried.failed or tried.found is not None:
                return tried.found
            done.append(tried)
        try:
            return self._narrow.through_middle(done)
        except (GeometryError, ShapelyError):
            return None

    def _closely(self, path: FloatArray, smallest: bool) -> BoxSequence | None:
        """Cover a path at margin zero by the longest boxes, or by small ones that need little space."""
        return self._covered(path, 0.0, longest=True, smallest=smallest)

    def with_margin(
        self, first: BoxSequence, progress: Callable[[float, float], None], share: float = 1.0
    ) -> BoxSequence:
        """Move the best path away from the walls, and cover it at the largest margin that it keeps.

        Args:
            first: Boxes at margin zero.
            share: Share of the usual work that is spent on the path [-].
            progress: Called with a margin [m] and the fraction of the path that is covered.

        Returns:
            Boxes at a margin; at margin zero if no other margin is kept.
        """
        progress(0.0, 0.0)
        near = best_candidate(self._problem, self._hierarchy, first.path, BODY_GAP, share)
        return self._moved(near, share, progress) or self._covered(first.path, 0.0) or first

    def another(self, number: int, share: float) -> CoveredPath | None:
        """Find another path by other samples; see ``CoveredPath``."""
        try:
            near = another_candidate(self._problem, self._hierarchy, BODY_GAP, number, share)
            found = None if near is None else self._moved(near, share)
        except (GeometryError, ShapelyError):
            return None
        return None if found is None else self.covered_path(found, found)

    def _moved(
        self, near: FloatArray, share: float, progress: Callable[[float, float], None] | None = None
    ) -> BoxSequence | None:
        """Move a path away from the walls, and cover it at the largest margin that it keeps."""
        path = moved_from_obstacles(self._problem, near, BODY_GAP, share)
        for margin in margins_to_try(self._problem, path):
            if progress is not None:
                progress(margin, 0.0)
            try:
                found = self._covered(path, margin, progress)
            except (GeometryError, ShapelyError):
                found = None
            if found is not None:
                return found
        return self._covered(path, 0.0)

    def _covered(
        self,
        path: FloatArray,
        margin: float,
        progress: Callable[[float, float], None] | None = None,
        *,
        longest: bool = False,
        smallest: bool = False,
    ) -> BoxSequence | None:
        """Cover a path with boxes that keep a margin."""
        workspace = marginal_workspace(self._problem, margin)
        certifier = Certifier(self._swept, self._pairs, workspace, self._scale, margin)
        report = None if progress is None else (lambda fraction: progress(margin, fraction))
        boxes = certifier.boxes(path, report, longest=longest, smallest=smallest)
        self.slices += certifier.trials
        return None if boxes is None else BoxSequence(tuple(boxes), path, margin)

    def covered_path(self, found: BoxSequence, spare: BoxSequence) -> CoveredPath:
        """The path of some boxes, whose polygons are made on request.

        Args:
            found: The boxes.
            spare: Boxes to use if the polygons of the others cannot be made.
        """

        def channel() -> Channel:
            made = self._channel(found) or self._channel(spare)
            if made is None:
                raise GeometryError("the free positions of the boxes along a path cannot be computed")
            return made

        return CoveredPath(found.path, found.margin, channel, self.another)

    def _channel(self, found: BoxSequence) -> Channel | None:
        """Boxes with all positions that are free for them; None if geometry fails."""
        regions = Regions(self._problem, self._swept, self._pairs, found.margin)
        boxes = [regions.around(box) for box in found.boxes]
        made = [box for box in boxes if box is not None]
        if len(made) < len(boxes):
            return None
        ends = np.array([box.positions[-1] for box in found.boxes])
        return replace(make_channel(self._problem, made, found.margin, found.path), ends=ends)
