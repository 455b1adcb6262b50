"""Over-cells of halves of slices: computed for a trial split, and used again if that split is chosen."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import Slices, halves


@dataclass(frozen=True)
class Half:
    """One half of a slice.

    Attributes:
        intervals: Its nominal intervals.
        regions: Its over-cells.
    """

    intervals: Intervals
    regions: list[Region]


class Halves:
    """Keeps the halves of every slice until the slice is split."""

    def __init__(self, slices: Slices, maker: CellMaker) -> None:
        self._slices, self._maker = slices, maker
        self._tried: dict[int, dict[int, tuple[Half, Half]]] = {}

    def of(self, index: int, axis: int) -> tuple[Half, Half]:
        """The lower and the upper half of a leaf along an axis."""
        tried = self._tried.setdefault(index, {})
        if axis not in tried:
            lower, upper = halves(self._slices.all[index].intervals, axis)
            tried[axis] = self._made(lower), self._made(upper)
        return tried[axis]

    def taken(self, index: int, axis: int) -> tuple[Half, Half]:
        """Return the halves of a leaf that is split now, and forget all trial splits of that leaf."""
        chosen = self.of(index, axis)
        del self._tried[index]
        return chosen

    def _made(self, intervals: Intervals) -> Half:
        return Half(intervals, self._maker.over_cells(intervals))
