"""Attempts at a channel: paths are sampled, improved and covered with boxes; sound whatever was sampled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.boxes.boxes import Box, Regions, make_channel
from coop_drake.planning.boxes.certify import Certifier, PathBox
from coop_drake.planning.boxes.channel import Channel, Way
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.questions.margins import exact_footprint, marginal_workspace
from coop_drake.planning.sampling.clear_paths import best_of, margins_along, with_room
from coop_drake.planning.sampling.elastic_band import drawn_tight
from coop_drake.planning.sampling.narrow_passages import fitted, widened
from coop_drake.planning.sampling.sampler import Ladder, Sampler
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

_CLEARANCES = (0.015, 0.002)
_SAMPLES = 4_000
_GAP = 0.01
_GROWTHS, _GROWTH_SEEDS = (0.1, 0.06, 0.03), 2
_FIRST_BANDS = (0.05, 600), (0.05, 3_000)
_LIGHT_TRIES = 4
_HEAVY_SAMPLES = 32_000

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
            fits: list[FloatArray] = []
            for seed, growth in product(range(_GROWTH_SEEDS), _GROWTHS if self._inside else ()):
                larger = widened(self._problem.workspace, growth)
                path = Sampler(self._ladder, larger, _GAP, seed, progress).path(_SAMPLES)
                close = fitted(self._problem, path, growth) if len(path) else None
                if close is not None:
                    fits.append(close)
                    chain = self._chain(close, 0.0, quick=True)
                    if chain is not None:
                        return chain
            # Boxes for a millimetre of room last: others can be executed sooner.
            covered = (self._chain(close, 0.0, quick=True, last=True) for close in fits)
            return next((chain for chain in covered if chain is not None), None)
        except (GeometryError, ShapelyError):
            pass
        return None

    def with_margin(
        self, chain: Chain, tried: list[tuple[float, str]], progress: Callable[[float, float], None]
    ) -> Chain:
        """Draw the best path there is away from the walls, and cover it at the largest margin that it keeps.

        Args:
            chain: Boxes at no margin.
            tried: Takes the margins that are tried, each with its verdict.
            progress: Called with a margin and the share of a path that is covered.

        Returns:
            A chain at a margin, or at none if that is all there is.
        """
        progress(0.0, 0.0)
        near = best_of(self._problem, self._ladder, chain.path, _GAP)
        path = with_room(self._problem, near, _GAP)
        for margin in margins_along(self._problem, path):
            progress(margin, 0.0)
            try:
                found = self._chain(path, margin, progress)
            except (GeometryError, ShapelyError):
                found = None
            tried.append((margin, "not found" if found is None else "found"))
            if found is not None:
                return found
        tried.append((0.0, "found"))
        return self._chain(path, 0.0) or self._chain(chain.path, 0.0) or chain

    def _chain(
        self,
        path: FloatArray,
        margin: float,
        progress: Callable[[float, float], None] | None = None,
        *,
        quick: bool = False,
        last: bool = False,
    ) -> Chain | None:
        """Cover a path with boxes that keep a margin."""
        workspace = marginal_workspace(self._problem, margin)
        certifier = Certifier(self._swept, self._pairs, workspace, self._scale, margin)
        told = None if progress is None else (lambda share: progress(margin, share))
        boxes = certifier.boxes(path, told, quick=quick, last=last)
        self.slices += certifier.trials
        return None if boxes is None else Chain(tuple(boxes), path, margin)

    def way(self, chain: Chain, spare: Chain) -> Way:
        """A chain's path, with the channel of its boxes, or of a spare chain's where geometry fails."""

        def channel() -> Channel:
            found = self._channel(chain) or self._channel(spare)
            if found is None:
                raise GeometryError("the positions that are free for the boxes of a path cannot be made")
            return found

        return Way(chain.path, chain.margin, len(chain.boxes), channel)

    def _channel(self, chain: Chain) -> Channel | None:
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
