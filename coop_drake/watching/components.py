"""Which over-cells a path from the start might still reach: the parts that a proof keeps apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.slices import holds, share_facet
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.moments import Leaf

__all__ = ["Parts", "parts_from_start"]

_TOUCH = 1e-6  # Slack of the quick test that goes before the exact one [rad, m].


@dataclass(frozen=True, eq=False)
class Parts:
    """Over-cells by whether some chain of meeting over-cells joins them to the start.

    Attributes:
        reached: Slice and region of those that are joined.
        others: Slice and region of those that are not.
    """

    reached: tuple[tuple[Leaf, Region], ...]
    others: tuple[tuple[Leaf, Region], ...]


def parts_from_start(leaves: Sequence[Leaf], start: FloatArray) -> Parts:
    """Flood the over-cells from the start.

    Args:
        leaves: The leaves of a subdivision.
        start: (x, y, theta, q...) with the joints that the subdivision has, shape (2 + axes,) [m, rad].
    """
    open_leaves = [leaf for leaf in leaves if leaf.regions(Kind.MIXED)]
    if not open_leaves:
        return Parts((), ())
    cells = [
        (number, region) for number, leaf in enumerate(open_leaves) for region in leaf.regions(Kind.MIXED)
    ]
    angles = [float(angle) for angle in start[2:]]
    front = [
        cell
        for cell, (number, region) in enumerate(cells)
        if holds(open_leaves[number].intervals, angles) and region.holds(start[:2])
    ]
    unseen = dict.fromkeys(cell for cell in range(len(cells)) if cell not in front)
    neighbours = _Neighbours(open_leaves)
    by_leaf: dict[int, list[int]] = {}
    for cell, (number, _) in enumerate(cells):
        by_leaf.setdefault(number, []).append(cell)
    while front:
        number, region = cells[front.pop()]
        for other in neighbours.of(number):
            for cell in by_leaf[other]:
                if cell in unseen and region.meets(cells[cell][1]):
                    del unseen[cell]
                    front.append(cell)
    split: tuple[list[tuple[Leaf, Region]], list[tuple[Leaf, Region]]] = ([], [])
    for cell, (number, region) in enumerate(cells):
        split[cell in unseen].append((open_leaves[number], region))
    return Parts(tuple(split[0]), tuple(split[1]))


class _Neighbours:
    """Finds the slices that share a facet with one, each answer once.

    Args:
        leaves: The slices to choose among.
    """

    def __init__(self, leaves: Sequence[Leaf]) -> None:
        self._leaves = leaves
        bounds = np.array([leaf.intervals for leaf in leaves])
        self._middle, self._half = bounds.mean(axis=2), 0.5 * np.ptp(bounds, axis=2)
        self._found: dict[int, list[int]] = {}

    def of(self, number: int) -> list[int]:
        """Numbers of the slices that share a facet with slice ``number``."""
        if number not in self._found:
            away = np.abs(self._middle - self._middle[number])
            away[:, 0] = np.minimum(away[:, 0], np.abs(2.0 * np.pi - away[:, 0]))
            near = (away <= self._half + self._half[number] + _TOUCH).all(axis=1)
            own = self._leaves[number].intervals
            self._found[number] = [
                other
                for other in np.flatnonzero(near).tolist()
                if other != number and share_facet(own, self._leaves[other].intervals)
            ]
        return self._found[number]
