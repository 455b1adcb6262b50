"""Draws a floor that was read: the floor, what the growth of walls took from it, and the notes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from coop_drake.drawing import draw_polygon, draw_workspace, legend_above, new_figure, save_figure
from coop_drake.drawing.canvas import house_style
from coop_drake.drawing.colours import FLOOR, INK, LIGHT_GREY, VERMILLION
from coop_drake.floor_plans.plan import FloorPlan
from coop_drake.geometry.polygons import parts_of

_WIDTH = 8.0
"""Width of the figure [in]."""
_TALLEST = 9.0
"""Largest height of the figure [in]."""


def save_picture(plan: FloorPlan, path: Path, title: str, inside: tuple[float, float] | None = None) -> None:
    """Write a preview as PNG or SVG with a title; the point that chose the room is marked if given [m]."""
    from matplotlib.patches import Patch

    x, y, right, top = plan.polygon.bounds
    height = float(np.clip(1.4 + _WIDTH * (top - y) / (right - x), 3.5, _TALLEST))
    taken = plan.drawn.difference(plan.polygon)
    with house_style():
        figure = new_figure(_WIDTH, height, _caption(plan))
        axes = figure.add_subplot()
        draw_workspace(axes, plan.polygon)
        if taken.area > 1e-9:
            red = shapely.MultiPolygon(parts_of(taken))
            draw_polygon(axes, red, facecolor=VERMILLION, edgecolor="none", zorder=2)
        for ring in (plan.drawn.exterior, *plan.drawn.interiors):
            axes.plot(*shapely.get_coordinates(ring).T, color=LIGHT_GREY, linewidth=0.6, zorder=3)
        if inside is not None:
            axes.plot(*inside, marker="x", color=INK, markersize=8, zorder=4)
        axes.set_title(title, loc="left")
        patches = [Patch(facecolor=FLOOR, edgecolor=INK, label="floor")]
        if taken.area > 1e-9:
            patches.append(Patch(color=VERMILLION, label=f"taken by walls: {taken.area:.3g} m²"))
        legend_above(axes, patches)
        save_figure(figure, path)


def _caption(plan: FloorPlan) -> str:
    x, y, right, top = plan.polygon.bounds
    facts = [
        f"{right - x:.2f} m by {top - y:.2f} m, {plan.polygon.area:.1f} m² of floor",
        "{} obstacles, {} corners of {} drawn".format(len(plan.polygon.interiors), *plan.corners),
    ]
    if plan.others:
        facts.append(f"{len(plan.others)} other rooms, the largest of {plan.others[0]:.1f} m²")
    return ". ".join([*facts, *plan.notes]) + "."
