"""The right half of a keyframe's figure: how theta and every joint are cut into slices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from coop_drake.drawing import colours
from coop_drake.drawing.floor import draw_polygon
from coop_drake.geometry.parts import parts_of
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.channel_path import PathPiece
from coop_drake.watching.floor_panel import draw_piece
from coop_drake.watching.search_states import ChannelCell, Leaf
from coop_drake.watching.theta_layers import THETA, on_turn

_FILLED, _TINT = 0.5, 0.35
"""Opacities of slices, and of the channel's slices over them: the path and what is halved stand out."""


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
        circular: Whether the joint is a circle.
    """

    def __init__(self, ax: Axes, axis: int, limits: Interval, *, circular: bool = False) -> None:
        self._ax, self._axis, self._limits, self._circular = ax, axis, limits, circular

    def draw_leaves(self, leaves: Sequence[Leaf], fills: Sequence[str]) -> None:
        """Fill the rectangle of every leaf with its colour."""
        parts = [(part, fill) for leaf, fill in zip(leaves, fills, strict=True) for part in self._parts(leaf)]
        rectangles, colour_of = [part for part, _ in parts], [fill for _, fill in parts]
        self._add(rectangles, facecolors=colour_of, edgecolors=colours.PAPER, linewidths=0.3, alpha=_FILLED)

    def hatch(self, leaves: Sequence[Leaf], colour: str) -> None:
        """Hatch the rectangle of every leaf."""
        rectangles = [part for leaf in leaves for part in self._parts(leaf)]
        self._add(rectangles, facecolors="none", edgecolors=colour, linewidths=0.0, hatch="////")

    def draw_channel(self, channel: Sequence[ChannelCell]) -> None:
        """Tint the slices of a channel, whatever the values of the joints left out."""
        for proved, colour in ((True, colours.PROVED_FREE), (False, colours.UNDECIDED_CHANNEL)):
            cells = [cell for cell in channel if (cell.kind is Kind.FREE) == proved]
            parts = [shapely.box(x0, y0, x1, y1) for cell in cells for x0, y0, x1, y1 in self._boxes(cell)]
            for part in parts_of(shapely.union_all(parts)):
                draw_polygon(self._ax, part, facecolor=colour, edgecolor="none", alpha=_TINT, zorder=3)

    def draw_splits(self, splits: Sequence[tuple[Leaf, int]]) -> None:
        """Frame the slice that was halved last, with the line that halves it."""
        if not splits:
            return
        leaf, halved = splits[-1]
        frame = {"facecolors": "none", "edgecolors": colours.HALVED, "linewidths": 2.0, "zorder": 4}
        self._add(self._parts(leaf), **frame)
        if halved in (0, self._axis):
            (x0, x1), (y0, y1) = leaf.intervals[0], self._upright(leaf.intervals)
            x, y = THETA[0] + (0.5 * (x0 + x1) - THETA[0]) % (2 * pi), 0.5 * (y0 + y1)
            line = [(x, y0), (x, y1)] if halved == 0 else [(x0, y), (x1, y)]
            halving = LineCollection([line], colors=colours.HALVED, linewidths=2.0, zorder=4)
            self._ax.add_collection(halving, autolim=False)

    def draw_angles(self, path: Sequence[PathPiece]) -> None:
        """Draw how theta and the joint move along a channel: firm where it is proved free, dashed where not.

        The line is broken where theta, or a joint that is a circle, leaves the turn drawn.
        """
        for piece in path if self._axis else ():
            theta = THETA[0] + np.mod(piece.angles[:, 0] - THETA[0], 2 * pi)
            upright, turn = piece.angles[:, self._axis], np.abs(np.diff(theta))
            if self._circular:
                upright = self._limits[0] + np.mod(upright - self._limits[0], 2 * pi)
                turn = np.maximum(turn, np.abs(np.diff(upright)))
            jumps = np.flatnonzero(turn > pi) + 1
            draw_piece(self._ax, piece, np.insert(np.array([theta, upright]), jumps, np.nan, axis=1))

    def _parts(self, slice_: Leaf | ChannelCell) -> list[list[tuple[float, float]]]:
        """Return the corners of a slice, in two parts where it crosses the end of the turn drawn."""
        return [[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, y0, x1, y1 in self._boxes(slice_)]

    def _boxes(self, slice_: Leaf | ChannelCell) -> list[tuple[float, float, float, float]]:
        """Return the least and largest theta and joint position of a slice's parts."""
        y0, y1 = self._upright(slice_.intervals)
        return [(x0, y0, x1, y1) for x0, x1 in on_turn(slice_.intervals[0])]

    def _upright(self, intervals: Intervals) -> Interval:
        """Return the interval of the joint that is drawn upwards."""
        return intervals[self._axis] if self._axis else self._limits

    def _add(self, rectangles: list[list[tuple[float, float]]], **style: Any) -> None:
        self._ax.add_collection(PolyCollection(rectangles, **style), autolim=False)
