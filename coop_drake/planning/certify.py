"""Turn a candidate path into a chain of boxes that are proved free: over-swept, overlapping, greedy."""

from __future__ import annotations

import numpy as np

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.geometry.tree import ComponentTree
from coop_drake.planning.cells import CellMaker, Region
from coop_drake.planning.sampler import densified

_PADS = (0.06, 0.03, 0.015, 0.008)
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
    """

    def __init__(self, tree: ComponentTree, maker: CellMaker, scale: FloatArray) -> None:
        self._maker, self._scale = maker, scale
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
        for pad in _PADS:
            box = self._box(samples, i, i + 1, pad)
            if box is None:
                continue
            best, failed, reach = i + 1, last + 1, self._guess
            while failed - best > 1:
                j = min(best + reach, last) if failed > last else (best + failed) // 2
                longer = self._box(samples, i, j, pad)
                if longer is None:
                    failed = j
                else:
                    best, box, reach = j, longer, 2 * reach
            self._guess = max(1, (best - i) // 2)
            return best, box
        return None

    def _box(self, samples: FloatArray, i: int, j: int, pad: float) -> Box | None:
        part = samples[i : j + 1]
        lower, upper = part[:, 2:].min(axis=0), part[:, 2:].max(axis=0)
        grow = np.maximum(pad, pad * (upper - lower))
        lower, upper = lower - grow, upper + grow
        lower[1:], upper[1:] = np.maximum(lower[1:], self._lower), np.minimum(upper[1:], self._upper)
        intervals = tuple((float(a), float(b)) for a, b in zip(lower, upper, strict=True))
        if not self._maker.fits(intervals, part[[0, -1], :2]):
            return None
        for region in self._maker.under_cells(intervals):
            if region.holds(part[0]) and region.holds(part[-1]):
                return intervals, region
        return None
