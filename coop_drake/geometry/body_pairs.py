"""Collisions among object, arms and bases: pairs of bodies over a slice, which eq. (4) leaves out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coop_drake.geometry.distances import separated
from coop_drake.geometry.swept_tree import Intervals, SweptTree

TOUCH = 1e-6
"""Bodies closer than this touch [m]."""


@dataclass(frozen=True)
class BodyPair:
    """Two bodies that must never overlap.

    Attributes:
        first: Pieces of the first body, indices into ``SweptTree.pieces``.
        second: Pieces of the second body.
        first_stages: Number of joints between the first body and the nearest component that carries both.
        second_stages: Number of joints between the second body and that component.
        axes: Axes of the slice that move one body against the other; theta is never among them.
    """

    first: tuple[int, ...]
    second: tuple[int, ...]
    first_stages: int
    second_stages: int
    axes: tuple[int, ...]


class BodyPairs:
    """Conservative answers about all of ``ComponentTree.collision_pairs``, cached by the joints between.

    Attributes:
        pairs: All pairs of bodies.
        pieces: All pairs of their pieces, each with its stages to the common component, shape (k, 4).
    """

    def __init__(self, swept: SweptTree) -> None:
        self._swept = swept
        self.pairs = tuple(self._pair(a, b) for a, b in swept.tree.collision_pairs)
        self.pieces = np.array(
            [
                (i, j, pair.first_stages, pair.second_stages)
                for pair in self.pairs
                for i in pair.first
                for j in pair.second
            ],
            dtype=np.int64,
        ).reshape(-1, 4)
        self._touch: dict[tuple[object, ...], bool] = {}
        self._overlap: dict[tuple[object, ...], bool] = {}

    def touching(self, intervals: Intervals) -> BodyPair | None:
        """First pair that may touch somewhere in the slice; None proves the whole slice free of contact."""
        return self._first(self._may_touch, self._touch, intervals)

    def overlapping(self, intervals: Intervals) -> BodyPair | None:
        """First pair that overlaps all over the slice: proves that no configuration in it is free."""
        return self._first(self._must_overlap, self._overlap, intervals)

    def _first(
        self,
        test: Callable[[BodyPair, Intervals], bool],
        known: dict[tuple[object, ...], bool],
        intervals: Intervals,
    ) -> BodyPair | None:
        """First pair that passes a test; results are cached by the intervals that move the pair."""
        for number, pair in enumerate(self.pairs):
            key = (number, *[intervals[axis] for axis in pair.axes])
            if key not in known:
                known[key] = test(pair, intervals)
            if known[key]:
                return pair
        return None

    def _may_touch(self, pair: BodyPair, intervals: Intervals) -> bool:
        others = [self._swept.over(j, intervals, pair.second_stages) for j in pair.second]
        return any(
            not separated(self._swept.over(i, intervals, pair.first_stages), other, TOUCH)
            for i in pair.first
            for other in others
        )

    def _must_overlap(self, pair: BodyPair, intervals: Intervals) -> bool:
        others = [self._swept.under(j, intervals, pair.second_stages) for j in pair.second]
        for i in pair.first:
            piece = self._swept.under(i, intervals, pair.first_stages)
            if piece is not None and any(o is not None and not separated(piece, o, -TOUCH) for o in others):
                return True
        return False

    def _pair(self, first: tuple[int, int], second: tuple[int, int]) -> BodyPair:
        chains = [self._swept.tree.ancestors[component] for component, _ in (first, second)]
        common = next(i for i in chains[0] if i in chains[1])
        stages = [chain.index(common) for chain in chains]
        members = [
            tuple(n for n, piece in enumerate(self._swept.pieces) if (piece.component, piece.body) == body)
            for body in (first, second)
        ]
        axes = [
            1 + joint.index
            for chain, count in zip(chains, stages, strict=True)
            for joint in (self._swept.tree.components[i].joint for i in chain[:count])
            if joint is not None
        ]
        return BodyPair(members[0], members[1], stages[0], stages[1], tuple(sorted(axes)))
