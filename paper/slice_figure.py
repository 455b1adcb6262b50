"""Slices of the angles: over- and under-approximations of the footprint, and the cells that follow."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from shapely import Polygon, union_all

from coop_drake.answers.problem import PlanningProblem
from coop_drake.drawing.canvas import draw_polygon, draw_team, draw_workspace, new_figure
from coop_drake.drawing.colours import FLOOR, INK, PROVED_FREE, UNDECIDED
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.watching.pictures import draw_section

__all__ = ["slice_figure"]

_SAMPLES = 3
"""Number of values of every axis at which the team is drawn."""


def slice_figure(problem: PlanningProblem, slices: Sequence[Intervals]) -> Figure:
    """Draw slices one under the other: footprints (6) at the left, cells (5), (8) at the right.

    Args:
        problem: Floor and team.
        slices: Intervals (lower, upper) of the axes (theta, q...) of every slice [rad, m].
    """
    figure = new_figure(
        10.0,
        4.4 * len(slices) + 0.5,
        "Left: the team at some angles of the slice (light), what it may cover (outline) and what it covers "
        "at all of them (dark). Right: where the object may stand, by what these leave of the floor.",
    )
    rows = figure.subplots(len(slices), 2, squeeze=False, sharex="col", sharey="col")
    for (left, right), intervals in zip(rows, slices, strict=True):
        swept = SweptTree(problem.tree)
        _draw_footprints(left, problem, swept, intervals)
        _draw_cells(right, problem, CellMaker(swept, problem.workspace), intervals)
    return figure


def _draw_footprints(ax: Axes, problem: PlanningProblem, swept: SweptTree, intervals: Intervals) -> None:
    for angles in product(*(np.linspace(lower, upper, _SAMPLES) for lower, upper in intervals)):
        draw_team(ax, problem.tree, np.array([0.0, 0.0, *angles]), alpha=0.07, zorder=2.0)
    pieces = range(len(swept.pieces))
    over = union_all([Polygon(swept.over(index, intervals)) for index in pieces])
    under = [swept.under(index, intervals) for index in pieces]
    draw_polygon(ax, over, facecolor="none", edgecolor=INK, linewidth=1.6, zorder=4.0)
    common = union_all([Polygon(ring) for ring in under if ring is not None])
    draw_polygon(ax, common, facecolor=INK, edgecolor="none", alpha=0.75, zorder=3.5)
    ax.autoscale_view()
    ax.set_aspect("equal")
    ax.set_xlabel("x from the object [m]")
    ax.set_ylabel("y from the object [m]")
    ax.set_title(_slice_name(problem, intervals), fontsize=9, loc="left")


def _draw_cells(ax: Axes, problem: PlanningProblem, cells: CellMaker, intervals: Intervals) -> None:
    draw_workspace(ax, problem.workspace)
    over, under = cells.over_cells(intervals), cells.under_cells(intervals)
    for regions, colour in ((over, UNDECIDED), (under, PROVED_FREE)):
        for region in regions:
            draw_section(ax, region.section, colour, 0.55)
    ax.legend(
        handles=[
            Patch(color=PROVED_FREE, alpha=0.6, label=f"proved free: {_area(under):.1f} m²"),
            Patch(color=UNDECIDED, alpha=0.6, label=f"may be free: {_area(over):.1f} m²"),
            Patch(facecolor=FLOOR, edgecolor=INK, label="no configuration is free"),
        ],
        fontsize=8,
        loc="lower right",
    )


def _area(regions: Sequence[Region]) -> float:
    return sum(region.area for region in regions)


def _slice_name(problem: PlanningProblem, intervals: Intervals) -> str:
    """Return the intervals of a slice in words."""
    axes = [("θ", "rad"), *((joint.name.replace("::", " "), joint.unit) for joint in problem.tree.joints)]
    return ",  ".join(
        f"{name} {np.degrees(lower):.0f}° to {np.degrees(upper):.0f}°"
        if unit == "rad"
        else f"{name} {lower:.2f} m to {upper:.2f} m"
        for (name, unit), (lower, upper) in zip(axes, intervals, strict=True)
    )
