"""The figure of Table 1: every cell's intervals as bars, the paper's beside ours."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from coop_drake.answers import Plan
from coop_drake.drawing.canvas import new_figure
from coop_drake.drawing.colours import GREY, INK, OBJECT, robot_colour
from coop_drake.tree.arrays import FloatArray
from paper.table_1 import CORRECTED, PRINTED

__all__ = ["interval_figure"]

_AXES = ("θ [rad]", "q₁₁ [rad]", "q₂₁ [rad]")


def interval_figure(plan: Plan) -> Figure:
    """Draw the intervals of the paper's cells and of a plan's, axis by axis over the cells' numbers.

    Args:
        plan: Of a team of two robots with a joint each.
    """
    caption = (
        "Table 1. What every cell allows: intervals of the object's angle and of both joints, cell after "
        "cell. Left the paper's cells, a cross where it prints a wrong sign; right the cells of our plan."
    )
    figure = new_figure(9.5, 6.6, caption)
    rows = figure.subplots(3, 2, sharey="row", sharex="col")
    ours = np.array(
        [[bound for pair in zip(c.lower, c.upper, strict=True) for bound in pair] for c in plan.cells]
    )
    for axis, (left, right) in enumerate(rows):
        colour = OBJECT if axis == 0 else robot_colour(axis - 1)
        _bars(left, CORRECTED, axis, colour)
        _bars(right, ours, axis, colour)
        left.set_ylabel(_AXES[axis])
        _mark_misprints(left, axis)
    rows[0, 0].set_title(f"the paper: {len(CORRECTED)} cells")
    rows[0, 1].set_title(f"ours: {len(ours)} cells")
    for ax in rows[-1]:
        ax.set_xlabel("cell")
    misprint = Line2D([], [], color=INK, marker="x", linestyle="none", markersize=5, label="as printed")
    rows[1, 0].legend(handles=[misprint], loc="upper right")
    return figure


def _bars(ax: Axes, table: FloatArray, axis: int, colour: str) -> None:
    lower, upper = table[:, 2 * axis], table[:, 2 * axis + 1]
    ax.bar(np.arange(1, len(table) + 1), upper - lower, bottom=lower, width=0.8, color=colour, alpha=0.75)
    ax.axhline(0.0, color=GREY, linewidth=0.6)


def _mark_misprints(ax: Axes, axis: int) -> None:
    for column in (2 * axis, 2 * axis + 1):
        wrong = np.flatnonzero(PRINTED[:, column] != CORRECTED[:, column])
        ax.plot(wrong + 1, PRINTED[wrong, column], "x", color=INK, markersize=5)
