"""Attempts at a channel: paths are sampled, improved and covered with boxes; sound whatever was sampled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from shapely import MultiPolygon
from shapely.errors import ShapelyError

from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.band import drawn_tight, hurried_time
from coop_drake.planning.boxes import Box, Regions, make_channel
from coop_drake.planning.cells import Region
from coop_drake.planning.certify import Certifier, PathBox
from coop_drake.planning.channel import Channel
from coop_drake.planning.margins import exact_footprint, marginal_workspace, margins
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.refine import configuration_scale
from coop_drake.planning.sampler import Ladder, Sampler
from coop_drake.planning.tightening import fitted, widened

_CLEARANCES = (0.015, 0.002)
_CLEARANCE_SHARE = 1.3
_SAMPLES = 4_000
_GAP = 0.01
_GROWTHS, _GROWTH_SEEDS = (0.06, 0.1, 0.03), 2
_FIRST_BANDS = (0.05, 600), (0.05, 3_000)
_BRIEF_BAND = 0.1, 1_500
_BANDS = (0.1, 3_000), (0.05, 1_000)
_LIGHT_TRIES = 4
_HEAVY_SAMPLES = 32_000
_MORE_SAMPLES = 8_000
_OTHERS, _FRESH = 3, 1
_DETOUR = 1.5
_MARGIN_SEED = 1
_STEPS_UP = (1.2, 1.1)
_STEPS_DOWN = (0.9, 0.8)

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Chain:
    """Boxes along a path that are proved free: a channel, but for its polygons.

    Attributes:
        boxes: From the start's to the goal's.
        path: The path that they cover, theta unwrapped, shape (m, 3 + n).
        margin: The margin that the path's positions keep, in every box [m].
    """

    boxes: tuple[PathBox, ...]
    path: FloatArray
    margin: float


class SampledAttempts:
    """Find a chain of boxes at any margin first, then look for a larger margin near it.

    Args:
        problem: The question.

    Attributes:
        slices: Boxes tried so far.
        object_blocked: How many times in a row no path was found even for the object alone.
    """

    def __init__(self, problem: PlanningProblem) -> None:
        self._problem = problem
        self._swept = SweptTree(problem.tree)
        self._pairs = BodyPairs(self._swept)
        self._scale = configuration_scale(problem.tree)
        self._ladder = Ladder(problem)
        self._inside = problem.workspace.contains(exact_footprint(problem.tree, problem.start))
        self._tries = 0
        self.slices = 0
        self.object_blocked = 0

    def first(self, progress: Progress | None = None) -> Chain | None:
        """Sample one path and cover it, at no margin; every call draws other samples, now and then more.

        Args:
            progress: Called with the share of the sampling that is done.
        """
        self._tries += 1
        try:
            return self._first(self._tries, progress) if self._inside else None
        except (GeometryError, ShapelyError):
            return None

    def _first(self, number: int, progress: Progress | None) -> Chain | None:
        clearance = _CLEARANCES[(number - 1) % len(_CLEARANCES)]
        workspace = marginal_workspace(self._problem, clearance)
        sampler = Sampler(self._ladder, workspace, _GAP, number - 1, progress)
        path = sampler.path(_samples(number))
        self.object_blocked = self.object_blocked + 1 if sampler.object_blocked else 0
        if len(path) == 0:
            return None
        for spacing, moves in _FIRST_BANDS:
            path = drawn_tight(self._problem, path, clearance, 0.0, _GAP, spacing, moves)
            chain = self._chain(path, 0.0, quick=True)
            if chain is not None:
                return chain
        return None

    def squeezed(self, progress: Progress | None = None) -> Chain | None:
        """Sample paths on floors a little larger, and draw them tight until they fit, at no margin.

        It finds what is too narrow for samples; whether it fits is proved by boxes on the floor as it is.

        Args:
            progress: Called with the share of the sampling that is done.
        """
        try:
            for seed, growth in product(range(_GROWTH_SEEDS), _GROWTHS if self._inside else ()):
                larger = widened(self._problem.workspace, growth)
                path = Sampler(self._ladder, larger, _GAP, seed, progress).path(_SAMPLES)
                close = fitted(self._problem, path, growth) if len(path) else None
                chain = None if close is None else self._chain(close, 0.0, quick=True)
                if chain is not None:
                    return chain
        except (GeometryError, ShapelyError):
            pass
        return None

    def with_margin(
        self, chain: Chain, tried: list[tuple[float, str]], progress: Callable[[float, float], None]
    ) -> Chain:
        """Look for the largest margin at which a path can be covered, best near the one that is known.

        Args:
            chain: Boxes at no margin.
            tried: Takes the margins that are tried, each with its verdict.
            progress: Called with a margin and the share of a path that is covered.

        Returns:
            A chain at the margin, or at none if that is all there is.
        """
        progress(0.0, 0.0)
        near = self._quickest(chain.path)
        for margin in margins(self._problem.settings.margin):
            progress(margin, 0.0)
            try:
                found = self._at(margin, near, progress)
            except (GeometryError, ShapelyError):
                found = None
            tried.append(
                (margin if found is None else found.margin, "not found" if found is None else "found")
            )
            if found is not None:
                return found
        path = near
        for spacing, moves in _BANDS:
            path = drawn_tight(self._problem, path, _CLEARANCES[-1], 0.0, _GAP, spacing, moves)
        tried.append((0.0, "found"))
        return self._chain(path, 0.0) or self._chain(chain.path, 0.0) or chain

    def _at(self, margin: float, near: FloatArray, progress: Callable[[float, float], None]) -> Chain | None:
        """A chain at a margin or not far from it, along the quickest of some sampled paths."""
        clearance = _CLEARANCE_SHARE * margin
        path = self._sampled(marginal_workspace(self._problem, clearance), near)
        if path is None:
            return None
        for spacing, moves in _BANDS:
            path = drawn_tight(self._problem, path, clearance, margin, _GAP, spacing, moves)
        chain = self._chain(path, margin, progress)
        if chain is None:
            smaller = (self._chain(path, share * margin, progress) for share in _STEPS_DOWN)
            return next((less for less in smaller if less is not None), None)
        if margin < self._problem.settings.margin:
            larger = (self._chain(path, share * margin, progress) for share in _STEPS_UP)
            return next((more for more in larger if more is not None), chain)
        return chain

    def _quickest(self, known: FloatArray) -> FloatArray:
        """The quickest of a known path and of some more: they may turn another way."""
        workspace = marginal_workspace(self._problem, _CLEARANCES[0])
        sampler = Sampler(self._ladder, workspace, _GAP, _MARGIN_SEED)
        sampled = [known, *(sampler.path(_MORE_SAMPLES) for _ in range(_OTHERS))]
        tight = [
            drawn_tight(self._problem, path, _CLEARANCES[-1], 0.0, _GAP, *_BRIEF_BAND)
            for path in sampled
            if len(path)
        ]
        return min(tight, key=hurried_time)

    def _sampled(self, workspace: MultiPolygon, near: FloatArray) -> FloatArray | None:
        """The quickest of a path sampled near another one and of some sampled anywhere.

        None if there is none that is nearly as quick as that other one. Those sampled anywhere end with the
        first failure if there is no path yet: more would fail, too.
        """
        sampler = Sampler(self._ladder, workspace, _GAP, _MARGIN_SEED)
        paths = [sampler.along(near, _SAMPLES)]
        for _ in range(_FRESH):
            paths.append(sampler.path(_MORE_SAMPLES))
            if not any(map(len, paths)):
                break
        best = min((path for path in paths if len(path)), key=hurried_time, default=None)
        return None if best is None or hurried_time(best) > _DETOUR * hurried_time(near) else best

    def _chain(
        self,
        path: FloatArray,
        margin: float,
        progress: Callable[[float, float], None] | None = None,
        *,
        quick: bool = False,
    ) -> Chain | None:
        """Cover a path with boxes that keep a margin."""
        workspace = marginal_workspace(self._problem, margin)
        certifier = Certifier(self._swept, self._pairs, workspace, self._scale, margin)
        told = None if progress is None else (lambda share: progress(margin, share))
        boxes = certifier.boxes(path, told, quick=quick)
        self.slices += certifier.trials
        return None if boxes is None else Chain(tuple(boxes), path, margin)

    def channel(self, chain: Chain) -> Channel | None:
        """Boxes of a chain with all positions that are free for them; None if geometry fails."""
        regions = Regions(self._problem, self._swept, self._pairs, chain.margin)
        boxes = [regions.around(box) for box in chain.boxes]
        held = [box for box in boxes if box is not None]
        return (
            make_channel(self._problem, held, chain.margin, chain.path) if len(held) == len(boxes) else None
        )

    def channel_of(self, boxes: Sequence[tuple[Intervals, Region]]) -> Channel:
        """The channel of boxes that an exploration found, at no margin."""
        return make_channel(self._problem, [Box(*box, core=box[1]) for box in boxes], 0.0, None)


def _samples(number: int) -> int:
    """Samples for each stage of a try, counted from 1: few at first, then many."""
    if number <= _LIGHT_TRIES:
        return _SAMPLES * luby(number)
    return _HEAVY_SAMPLES * luby(number - _LIGHT_TRIES)


def luby(number: int) -> int:
    """Luby's budgets for restarts: 1 1 2 1 1 2 4 and so on, counted from 1."""
    size = int(np.log2(number + 1))
    return 1 << size - 1 if number + 1 == 1 << size else luby(number + 1 - (1 << size))
