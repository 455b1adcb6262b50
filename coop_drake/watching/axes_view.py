"""The right half of a frame: how theta and every joint are cut into slices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from coop_drake.drawing.colours import INK
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching import look
from coop_drake.watching.moments import Leaf, Link
from coop_drake.watching.stack import THETA, on_turn
from coop_drake.watching.way import Leg

__all__ = [
    "cut",
    "draw_angles",
    "draw_channel_tiles",
    "draw_hatch",
    "draw_looked_at",
    "draw_tiles",
    "leaf_colour",
]


_TOUCH = 1e-9


def cut(leaves: Iterable[Leaf], axis: int, point: FloatArray) -> list[Leaf]:
    """Leaves that the plane of theta and one joint meets, where all other joints have the point's values.

    Args:
        leaves: The leaves of a subdivision.
        axis: The joint's axis, 1 or more; 0 keeps theta alone.
        point: Values of (theta, q...), shape (1 + n,) [rad, m].
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
    """Whether an interval holds a value; of two that meet there it is the upper one."""
    return interval[0] <= value < interval[1] or value >= interval[1] == limit


def leaf_colour(leaf: Leaf) -> str:
    """Colour of a leaf: blocked, undecided, or the darker the more of it is proved free."""
    share = leaf.free_share
    if share is None:
        return look.BLOCKED
    return look.MIXED if share == 0.0 else look.mixture(look.PARTLY_FREE, look.FREE, share)


def draw_tiles(
    ax: Axes, leaves: Sequence[Leaf], axis: int, colours: Sequence[str], *, limits: Interval
) -> None:
    """Fill the rectangle of every leaf; ``axis`` 0 draws strips over the limits of a single axis."""
    drawn = [
        (_rectangle(turned, axis, limits), colour)
        for leaf, colour in zip(leaves, colours, strict=True)
        for turned in _into_view(leaf.intervals)
    ]
    rectangles, fills = [rectangle for rectangle, _ in drawn], [colour for _, colour in drawn]
    ax.add_collection(
        PolyCollection(rectangles, facecolors=fills, edgecolors="white", linewidths=0.5, alpha=0.7),
        autolim=False,
    )


def draw_hatch(ax: Axes, leaves: Sequence[Leaf], axis: int, colour: str, *, limits: Interval) -> None:
    """Hatch the rectangle of every leaf."""
    rectangles = [
        _rectangle(turned, axis, limits) for leaf in leaves for turned in _into_view(leaf.intervals)
    ]
    hatched = PolyCollection(rectangles, facecolors="none", edgecolors=colour, linewidths=0.0, hatch="////")
    ax.add_collection(hatched, autolim=False)


def draw_channel_tiles(ax: Axes, channel: Sequence[Link], axis: int, *, limits: Interval) -> None:
    """Outline the slices of a channel, whatever the values of the joints left out."""
    for kind, colour in ((Kind.FREE, look.CHANNEL), (None, look.OPEN_CHANNEL)):
        rectangles = [
            _rectangle(turned, axis, limits)
            for link in channel
            if (link.kind is Kind.FREE) == (kind is Kind.FREE)
            for turned in _into_view(link.intervals)
        ]
        ax.add_collection(
            PolyCollection(rectangles, facecolors="none", edgecolors=colour, linewidths=0.8, zorder=3),
            autolim=False,
        )


def draw_looked_at(ax: Axes, splits: Sequence[tuple[Leaf, int]], axis: int, *, limits: Interval) -> None:
    """Frame the slices that were just halved, the last one boldly, with the line that halves it."""
    if not splits:
        return
    drawn = [
        (_rectangle(turned, axis, limits), 1.0 if leaf is not splits[-1][0] else 2.6)
        for leaf, _ in splits
        for turned in _into_view(leaf.intervals)
    ]
    rectangles, widths = [rectangle for rectangle, _ in drawn], [width for _, width in drawn]
    ax.add_collection(
        PolyCollection(rectangles, facecolors="none", edgecolors=look.LOOKED_AT, linewidths=widths, zorder=4),
        autolim=False,
    )
    leaf, halved = splits[-1]
    if halved in (0, axis):
        (x0, x1), (y0, y1) = leaf.intervals[0], leaf.intervals[axis] if axis else limits
        x, y = THETA[0] + (0.5 * (x0 + x1) - THETA[0]) % (2 * pi), 0.5 * (y0 + y1)
        line = [(x, y0), (x, y1)] if halved == 0 else [(x0, y), (x1, y)]
        halving = LineCollection([line], colors=look.LOOKED_AT, linewidths=2.0, zorder=4)
        ax.add_collection(halving, autolim=False)


def draw_angles(ax: Axes, legs: Sequence[Leg], axis: int) -> None:
    """Draw how theta and one joint move along a channel, broken where theta leaves the turn drawn."""
    if not legs or axis == 0:
        return
    angles = np.concatenate([leg.angles for leg in legs])
    theta = THETA[0] + np.mod(angles[:, 0] - THETA[0], 2 * pi)
    jumps = np.flatnonzero(np.abs(np.diff(theta)) > pi) + 1
    x, y = np.insert(theta, jumps, np.nan), np.insert(angles[:, axis], jumps, np.nan)
    ax.plot(x, y, color=INK, linewidth=1.6, zorder=5)


def _rectangle(intervals: Intervals, axis: int, limits: Interval) -> list[tuple[float, float]]:
    (x0, x1), (y0, y1) = intervals[0], intervals[axis] if axis else limits
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def _into_view(intervals: Intervals) -> list[Intervals]:
    """The intervals with theta on the turn drawn, in two where it crosses the turn's end."""
    return [(theta, *intervals[1:]) for theta in on_turn(intervals[0])]
