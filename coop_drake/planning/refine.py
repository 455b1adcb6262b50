"""Which axis of a slice to halve: the one to blame for what is neither free nor blocked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.geometry.tree import ComponentTree
from coop_drake.planning.cells import CellMaker, Region
from coop_drake.planning.slices import Slices, halves

_DECIDED = 1e-3
_MOSTLY_FREE = 0.5
_LEAST_LEVER = 0.01


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


def axis_levers(tree: ComponentTree) -> tuple[float, ...]:
    """How far a unit of each axis (theta, q...) moves the furthest point it carries [m/rad or 1]."""
    reaches = [0.0] * len(tree.components)
    levers = [0.0] * (1 + len(tree.joints))
    for index in range(len(tree.components) - 1, -1, -1):
        component = tree.components[index]
        own = max(
            (
                float((shape.vertices**2).sum(axis=1).max() ** 0.5) + shape.radius
                for body in component.bodies
                for shape in body.shapes
            ),
            default=0.0,
        )
        reaches[index] = max(reaches[index], own)
        joint = component.joint
        if joint is None or component.parent is None:
            levers[0] = reaches[index]
            continue
        length = (joint.axis[0] ** 2 + joint.axis[1] ** 2) ** 0.5
        revolute = joint.kind == "revolute"
        levers[1 + joint.index] = reaches[index] if revolute else length
        slide = 0.0 if revolute else length * max(abs(joint.lower), abs(joint.upper))
        offset = (joint.X_PJ.x**2 + joint.X_PJ.y**2) ** 0.5
        reaches[component.parent] = max(reaches[component.parent], offset + slide + reaches[index])
    return tuple(levers)


def configuration_scale(tree: ComponentTree) -> FloatArray:
    """What a unit of each axis of z counts in distances between configurations, shape (3 + n,) [m/unit].

    It is the lever, but never nothing: a joint that moves no solid body still has to be moved.
    """
    return np.maximum([1.0, 1.0, *axis_levers(tree)], _LEAST_LEVER)
