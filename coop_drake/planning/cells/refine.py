"""Which axis of a slice to halve: the one to blame for what is neither free nor blocked."""

from __future__ import annotations

from collections.abc import Sequence

from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import Slices, halves

_DECIDED = 1e-3
_MOSTLY_FREE = 0.5


class Blame:
    """Chooses axes by what a halving frees.

    Args:
        maker: Cells of slices.
        slices: The subdivision.
        levers: How far a unit of each axis moves the team.
    """

    def __init__(self, maker: CellMaker, slices: Slices, levers: Sequence[float]) -> None:
        self._maker, self._slices, self._levers = maker, slices, levers

    def axis(self, intervals: Intervals, region: Region, axes: Sequence[int]) -> int:
        """Axis whose halving frees most of a region.

        Where no halving frees anything yet, it is the axis along which the team sweeps furthest. A contact
        among bodies in a slice that the walls leave free is charged to the joints involved alone.

        Args:
            intervals: A slice.
            region: The undecided cell of that slice.
            axes: The axes to choose from, at least one.
        """
        expanded = self._slices.expanded(intervals)
        pair = self._maker.blocked_pair(expanded)
        if pair is not None:
            free = shared(self._maker.under_region(expanded), region.section, over=False).area()
            involved = [axis for axis in pair.axes if axis in axes]
            if involved and free > _MOSTLY_FREE * region.area:
                return self._widest(intervals, involved)
        freed = [self._freed(intervals, axis, region) for axis in axes]
        if max(freed) <= _DECIDED * region.area:
            return self._widest(intervals, axes)
        return axes[freed.index(max(freed))]

    def _widest(self, intervals: Intervals, axes: Sequence[int]) -> int:
        sweep = [(intervals[axis][1] - intervals[axis][0]) * self._levers[axis] for axis in axes]
        return axes[sweep.index(max(sweep))]

    def _freed(self, intervals: Intervals, axis: int, region: Region) -> float:
        total = 0.0
        for half in halves(intervals, axis):
            under = self._maker.under_region(self._slices.expanded(half))
            total += shared(under, region.section, over=False).area()
        return round(total, 9)
