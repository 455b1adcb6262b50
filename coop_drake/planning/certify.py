"""Turn a candidate path into a chain of boxes that are proved free: over-swept, overlapping, greedy."""

from __future__ import annotations

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
    """

    def __init__(self, tree: ComponentTree, maker: CellMaker, scale: FloatArray, margin: float) -> None:
        self._maker, self._scale, self._margin = maker, scale, margin
        self._guess = 4
        self._lower, self._upper = tree.joint_lower, tree.joint_upper

    def boxes(self, path: FloatArray) -> list[Box] | None:
        """Chain of boxes from the path's first to its last configuration, or None if one is missing.

        Args:
            path: Configurations with theta unwrapped, shape (m, 3 + n).
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
        return chain

    def _longest(self, samples: FloatArray, i: int) -> tuple[int, Box] | None:
        """Furthest sample that one box holds together with sample i, and that box."""
        last = len(samples) - 1
        for pad, room in _LEVELS:
            box = self._box(samples, i, i + 1, pad, room)
            if box is None:
                continue
            chosen, pace = (i + 1, box), self._pace(samples, i, i + 1, box)
            best, failed, reach = i + 1, last + 1, self._guess
            while failed - best > 1:
                j = min(best + reach, last) if failed > last else (best + failed) // 2
                longer = self._box(samples, i, j, pad, room)
                if longer is None:
                    failed = j
                    continue
                best, reach = j, 2 * reach
                quicker = self._pace(samples, i, j, longer)
                if quicker >= pace:
                    chosen, pace = (j, longer), quicker
            self._guess = max(1, (best - i) // 2)
            return chosen
        return None

    def _pace(self, samples: FloatArray, i: int, j: int, box: Box) -> float:
        """Samples passed per second: a share for the box and the way at a speed that clearance allows."""
        part = samples[i : j + 1]
        length = float(np.hypot(*np.diff(part[:, :2], axis=0).T).sum())
        clearance = self._margin + float(box[1].depths(part[:, :2]).min())
        return (j - i) / (_BOX_TIME + length / (_SPEED * max(clearance, 1e-3)))

    def _box(self, samples: FloatArray, i: int, j: int, pad: float, room: float) -> Box | None:
        part = samples[i : j + 1]
        lower, upper = part[:, 2:].min(axis=0), part[:, 2:].max(axis=0)
        grow = np.maximum(pad, pad * (upper - lower))
        lower, upper = lower - grow, upper + grow
        lower[1:], upper[1:] = np.maximum(lower[1:], self._lower), np.minimum(upper[1:], self._upper)
        intervals = tuple((float(a), float(b)) for a, b in zip(lower, upper, strict=True))
        if not self._maker.fits(intervals, part[[0, -1], :2]):
            return None
        for region in self._maker.under_cells(intervals):
            if region.depths(part[[0, -1], :2]).min() > room:
                return intervals, region
        return None
