"""The figure beside the paper's Figure 3: a system, its over- and its under-approximations."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from shapely import get_coordinates, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.drawing.canvas import draw_polygon, draw_team, new_figure, team_legend
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK
from coop_drake.geometry.swept_tree import Interval
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree
from paper.approximation import Approximation

__all__ = ["approximation_figure"]

_BORDER = 0.12
"""Border around the widest over-approximation [m]."""

_OUTLINE_TOLERANCE = 2e-3
"""Distance by which outlines may move when they are simplified [m]."""


def approximation_figure(tree: ComponentTree, made: Sequence[Approximation]) -> Figure:
    """Draw the system, and for every slice its over-approximation above its under-approximation.

    Args:
        tree: The system.
        made: Its approximations.
    """
    caption = (
        "Figure 3. A system of two components (a), the object with what is welded to it and what the joint "
        "moves. For four slices of the angle θ and the joint q: above what encloses every configuration of "
        "the slice, below what every configuration covers. Grey: some configurations."
    )
    figure = new_figure(11.0, 6.4, caption)
    system, *upper = figure.subplots(2, 1 + len(made), sharex=True, sharey=True).flat
    below = upper[len(made) :]
    x_min, y_min, x_max, y_max = union_all([one.over for one in made]).bounds
    system.set_xlim(x_min - _BORDER, x_max + _BORDER)
    system.set_ylim(y_min - _BORDER, y_max + _BORDER)
    draw_team(system, tree, np.zeros(3 + len(tree.joints)))
    system.legend(handles=team_legend(tree), loc="lower left", fontsize=8, borderpad=0.2)
    _name(system, "(a) the system")
    below[0].axis("off")
    for number, one in enumerate(made):
        slice_name = f"θ {_range(one.intervals[0])}, q {_range(one.intervals[1])}"
        over, under = upper[number], below[1 + number]
        draw_polygon(over, one.over, facecolor=BLUE, edgecolor=BLUE, alpha=0.25)
        draw_polygon(under, one.under, facecolor=GREEN, edgecolor=GREEN, alpha=0.7, zorder=4)
        outlines = [line for shape in one.exact for line in _outlines(shape.simplify(_OUTLINE_TOLERANCE))]
        for ax in (over, under):
            ax.add_collection(LineCollection(outlines, colors=GREY, linewidths=0.4, alpha=0.35))
            draw_polygon(ax, one.over, facecolor="none", edgecolor=BLUE, linewidth=1.2)
        _name(over, f"({'bcde'[number]}) over\n{slice_name}")
        _name(under, f"({'fghi'[number]}) under\n{slice_name}")
    return figure


def _outlines(shape: BaseGeometry) -> list[FloatArray]:
    """Return the outer rings of a shape of one part or several, each of shape (n, 2)."""
    return [get_coordinates(part.exterior) for part in getattr(shape, "geoms", [shape])]


def _name(ax: Axes, title: str) -> None:
    ax.set_title(title, fontsize=9, color=INK)
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.label_outer()


def _range(interval: Interval) -> str:
    lower, upper = interval
    if lower == upper:
        return f"= {lower:g}"
    if abs(upper - 0.5 * pi) < 1e-12:
        return "±π/2"
    return f"±{upper:g}"
