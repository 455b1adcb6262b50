"""Turn a candidate path into a chain of boxes that are proved free: over-swept, overlapping, greedy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.geometry.tree import ComponentTree
from coop_drake.planning.cells import CellMaker, Region
from coop_drake.planning.sampler import densified

_LEVELS = ((0.06, 0.02), (0.03, 0.01), (0.015, 0.004), (0.004, 0.001))
_BOX_TIME = 0.6
_SPEED = 3.0
_RESOLUTION = 0.02
_PROOFS = 3

Box = tuple[Intervals, Region]


class Certifier:
    """Lays boxes along paths in one workspace.

    A box is sound whatever path it was laid for: its over-swept footprint fits everywhere in its region and
    no two bodies touch. Consecutive boxes share a sample of the path, padded in every angle.

    Args:
        tree: The team.
        maker: Cells in the workspace whose margin the boxes keep.
        scale: How far a unit of each axis of z moves the team, shape (3 + n,).
        margin: Clearance that the boxes' positions have beyond their regions [m].

    Attributes:
        trials: Boxes tried so far.
    """

    def __init__(self, tree: ComponentTree, maker: CellMaker, scale: FloatArray, margin: float) -> None:
        self._maker, self._scale, self._margin = maker, scale, margin
        self._guess = 4
        self.trials = 0
        self._lower, self._upper = tree.joint_lower, tree.joint_upper

    def boxes(self, path: FloatArray, progress: Callable[[float], None] | None = None) -> list[Box] | None:
        """Chain of boxes from the path's first to its last configuration, or None if one is missing.

        Args:
            path: Configurations with theta unwrapped, shape (m, 3 + n).
            progress: Called with the share of the path that is covered.
        """
        samples = densified(path, self._scale, _RESOLUTION)
        chain: list[Box] = []
        i = 0
        while i < len(samples) - 1:
            found = self._longest(samples, i)
            if found is None:
                return None
            i, box = found
            chain.append(box)
            if progress is not None:
                progress(i / (len(samples) - 1))
        return chain

    def _longest(self, samples: FloatArray, i: int) -> tuple[int, Box] | None:
        """Sample that one box holds together with sample i, and that box: the quickest of those tried."""
        last = len(samples) - 1
        for pad, room in _LEVELS:
            tried: list[tuple[float, int, Intervals]] = []
            best, failed, reach = i, last + 1, 1
            while failed - best > 1:
                j = min(best + reach, last) if failed > last else (best + failed) // 2
                intervals = self._intervals(samples[i : j + 1], pad)
                self.trials += 1
                clearance = self._maker.clearance(intervals, samples[i : j + 1, :2], room)
                if clearance < 0.0:
                    failed = j
                    continue
                reach = self._guess if best == i else 2 * reach
                best = j
                tried.append((self._pace(samples[i : j + 1], clearance), j, intervals))
            if tried:
                self._guess = max(1, (best - i) // 2)
            for _, j, intervals in sorted(tried, key=lambda entry: -entry[0])[:_PROOFS]:
                region = self._proved(intervals, samples[[i, j], :2], room)
                if region is not None:
                    return j, (intervals, region)
        return None

    def _pace(self, part: FloatArray, clearance: float) -> float:
        """Samples passed per second: a share for the box and the way at a speed that clearance allows."""
        length = float(np.hypot(*np.diff(part[:, :2], axis=0).T).sum())
        return (len(part) - 1) / (_BOX_TIME + length / (_SPEED * max(self._margin + clearance, 1e-3)))

    def _intervals(self, part: FloatArray, pad: float) -> Intervals:
        """Angles of some samples, padded, joints clipped at their limits."""
        lower, upper = part[:, 2:].min(axis=0), part[:, 2:].max(axis=0)
        grow = np.maximum(pad, pad * (upper - lower))
        lower, upper = lower - grow, upper + grow
        lower[1:], upper[1:] = np.maximum(lower[1:], self._lower), np.minimum(upper[1:], self._upper)
        return tuple((float(a), float(b)) for a, b in zip(lower, upper, strict=True))

    def _proved(self, intervals: Intervals, ends: FloatArray, room: float) -> Region | None:
        """The region of a box that holds both ends with some room, proved by sweeps and differences."""
        for region in self._maker.under_cells(intervals):
            if region.depths(ends).min() > room:
                return region
        return None
