"""The right half of a keyframe's figure: how theta and every joint are cut into slices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from coop_drake.drawing import colours
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.channel_path import PathPiece
from coop_drake.watching.search_states import ChannelCell, Leaf
from coop_drake.watching.theta_layers import THETA, on_turn


def cut(leaves: Iterable[Leaf], axis: int, point: FloatArray) -> list[Leaf]:
    """Return the leaves that a plane of theta and one joint meets; other joints have the point's values.

    The joint's axis is 1 or more; 0 keeps theta alone. The point is (theta, q...), shape (1 + n,) [rad, m].
    """
    leaves = list(leaves)
    others = [other for other in range(1, len(point)) if other != axis]
    limits = {other: max(leaf.intervals[other][1] for leaf in leaves) for other in others if leaves}
    return [
        leaf
        for leaf in leaves
        if all(_holds(leaf.intervals[other], float(point[other]), limits[other]) for other in others)
    ]


def _holds(interval: Interval, value: float, limit: float) -> bool:
    """Return whether an interval holds a value; of two that meet there the upper one does."""
    return interval[0] <= value < interval[1] or value >= interval[1] == limit


def leaf_colour(leaf: Leaf) -> str:
    """Return the colour of a leaf: blocked, undecided, or the darker the more of it is proved free."""
    free = leaf.free_fraction
    if free is None:
        return colours.BLOCKED
    return colours.UNDECIDED if free == 0.0 else colours.blend(colours.PARTLY_FREE, colours.PROVED_FREE, free)


class AnglePanel:
    """Draws slices as rectangles over theta and one joint.

    Args:
        ax: Where to draw.
        axis: The joint's axis among the exploration's (theta, q...); 0 draws strips over theta alone.
        limits: Limits of that joint [rad or m], or of the strips.
    """

    def __init__(self, ax: Axes, axis: int, limits: Interval) -> None:
        self._ax, self._axis, self._limits = ax, axis, limits

    def draw_leaves(self, leaves: Sequence[Leaf], fills: Sequence[str]) -> None:
        """Fill the rectangle of every leaf with its colour."""
        parts = [(part, fill) for leaf, fill in zip(leaves, fills, strict=True) for part in self._parts(leaf)]
        rectangles, colour_of = [part for part, _ in parts], [fill for _, fill in parts]
        self._add(rectangles, facecolors=colour_of, edgecolors=colours.PAPER, linewidths=0.5, alpha=0.7)

    def hatch(self, leaves: Sequence[Leaf], colour: str) -> None:
        """Hatch the rectangle of every leaf."""
        rectangles = [part for leaf in leaves for part in self._parts(leaf)]
        self._add(rectangles, facecolors="none", edgecolors=colour, linewidths=0.0, hatch="////")

    def draw_channel(self, channel: Sequence[ChannelCell]) -> None:
        """Outline the slices of a channel, whatever the values of the joints left out."""
        for proved, colour in ((True, colours.CHANNEL), (False, colours.UNDECIDED_CHANNEL)):
            cells = [cell for cell in channel if (cell.kind is Kind.FREE) == proved]
            rectangles = [part for cell in cells for part in self._parts(cell)]
            self._add(rectangles, facecolors="none", edgecolors=colour, linewidths=0.8, zorder=3)

    def draw_splits(self, splits: Sequence[tuple[Leaf, int]]) -> None:
        """Frame the slices that were just halved, the last one boldly, with the line that halves it."""
        if not splits:
            return
        leaf, halved = splits[-1]
        framed = [(part, 2.6 if one is leaf else 1.0) for one, _ in splits for part in self._parts(one)]
        rectangles, widths = [part for part, _ in framed], [width for _, width in framed]
        self._add(rectangles, facecolors="none", edgecolors=colours.HALVED, linewidths=widths, zorder=4)
        if halved in (0, self._axis):
            (x0, x1), (y0, y1) = leaf.intervals[0], self._upright(leaf.intervals)
            x, y = THETA[0] + (0.5 * (x0 + x1) - THETA[0]) % (2 * pi), 0.5 * (y0 + y1)
            line = [(x, y0), (x, y1)] if halved == 0 else [(x0, y), (x1, y)]
            halving = LineCollection([line], colors=colours.HALVED, linewidths=2.0, zorder=4)
            self._ax.add_collection(halving, autolim=False)

    def draw_angles(self, path: Sequence[PathPiece]) -> None:
        """Draw how theta and the joint move along a channel, broken where theta leaves the turn drawn."""
        if not path or self._axis == 0:
            return
        angles = np.concatenate([piece.angles for piece in path])
        theta = THETA[0] + np.mod(angles[:, 0] - THETA[0], 2 * pi)
        jumps = np.flatnonzero(np.abs(np.diff(theta)) > pi) + 1
        x, y = np.insert(theta, jumps, np.nan), np.insert(angles[:, self._axis], jumps, np.nan)
        self._ax.plot(x, y, color=colours.INK, linewidth=1.6, zorder=5)

    def _parts(self, slice_: Leaf | ChannelCell) -> list[list[tuple[float, float]]]:
        """Return the rectangle of a slice, in two parts where it crosses the end of the turn drawn."""
        y0, y1 = self._upright(slice_.intervals)
        return [[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, x1 in on_turn(slice_.intervals[0])]

    def _upright(self, intervals: Intervals) -> Interval:
        """Return the interval of the joint that is drawn upwards."""
        return intervals[self._axis] if self._axis else self._limits

    def _add(self, rectangles: list[list[tuple[float, float]]], **style: Any) -> None:
        self._ax.add_collection(PolyCollection(rectangles, **style), autolim=False)
