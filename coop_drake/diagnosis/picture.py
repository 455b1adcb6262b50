"""The picture of a diagnosis: the floor, the walls on both sides of a passage, the team where it collides."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Circle
from shapely import Point

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.diagnosing import Diagnosis
from coop_drake.diagnosis.widening import BlockingPassage
from coop_drake.drawing import draw_polygon, draw_workspace, new_figure, team_footprints
from coop_drake.drawing.colours import AT_FAULT, BLUE, GREY, INK, NOT_AT_FAULT, OUTSIDE, PAPER, WALL
from coop_drake.geometry.polygons import parts_of
from coop_drake.tree.pose import FloatArray

MOST_PLACES = 3
"""Places that are shown enlarged at most: more would be too small to read [-]."""

BORDER = 0.35
"""Border around the team in an enlarged place [m]."""

SIDE = 4.8
"""Height of every panel [in]."""


def diagnosis_figure(problem: PlanningProblem, diagnosis: Diagnosis) -> Figure | None:
    """Draw the whole floor and, enlarged beside it, every place that blocks; None if nothing does."""
    places = _places(diagnosis)
    if not places:
        return None
    places = places[:MOST_PLACES]
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    wide = min(2.0, max(0.5, (x_max - x_min + 0.6) / (y_max - y_min + 0.6)))
    caption = "Orange bodies collide at the goal; dark red is what lies behind a wall."
    if diagnosis.passages is not None:
        caption = (
            "Orange bodies collide with a wall in the passage; dark red is what lies behind the wall here. "
            "The blue line is the object's path with the walls moved back."
        )
    figure = new_figure(SIDE * (wide + len(places)) + 1.0, SIDE + 0.9, caption)
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.01, 0.09, 0.98, 0.88))
    axes = figure.subplots(1, 1 + len(places), squeeze=False, width_ratios=[wide, *[1.0] * len(places)])[0]
    _overview(axes[0], problem, diagnosis, [configuration for configuration, _, _ in places])
    for number, (ax, (configuration, bodies, passage)) in enumerate(
        zip(axes[1:], places, strict=True), start=1
    ):
        _enlarged(ax, problem, configuration, bodies)
        title = f"{number}: " if len(places) > 1 else ""
        if passage is not None:
            title += _mark_gap(ax, passage)
        else:
            title += _goal_title(diagnosis)
        ax.set_title(title, color=OUTSIDE, fontweight="bold")
    return figure


def _goal_title(diagnosis: Diagnosis) -> str:
    goal = diagnosis.goal
    depths = [] if goal is None else [c.depth for c in goal.contacts] + [o.depth for o in goal.overlaps]
    return "the goal is blocked" + (f", by {max(depths):.3f} m" if depths else "")


def _places(diagnosis: Diagnosis) -> list[tuple[FloatArray, frozenset[str], BlockingPassage | None]]:
    """Configurations to show, with the bodies at fault."""
    if diagnosis.goal is not None:
        goal = diagnosis.goal
        names = {contact.body for contact in goal.contacts}
        names.update(name for overlap in goal.overlaps for name in overlap.bodies)
        return [(goal.configuration, frozenset(names), None)]
    if diagnosis.passages is None:
        return []
    return [
        (p.stretch.configuration, frozenset(body.name for body in p.stretch.bodies), p)
        for p in diagnosis.passages.passages
    ]


def _overview(ax: Axes, problem: PlanningProblem, diagnosis: Diagnosis, places: list[FloatArray]) -> None:
    draw_workspace(ax, problem.workspace)
    if diagnosis.passages is not None and diagnosis.passages.path is not None:
        path = diagnosis.passages.path
        ax.plot(path[:, 0], path[:, 1], color=BLUE, linewidth=1.6, zorder=4)
    for label, pose in (("start", problem.start), ("goal", problem.goal_pose)):
        ax.plot(pose[0], pose[1], "o", color=INK, markersize=5, zorder=6)
        ax.annotate(label, _xy(pose), xytext=(6, 5), textcoords="offset points", zorder=6, fontweight="bold")
    for number, z in enumerate(places, start=1):
        for footprint in team_footprints(problem.tree, z):
            draw_polygon(ax, footprint.shape, facecolor=NOT_AT_FAULT, edgecolor="none", zorder=3)
        ring = Circle(_xy(z), problem.tree.reach, fill=False, edgecolor=OUTSIDE, linewidth=1.6, zorder=6)
        ax.add_patch(ring)
        if len(places) > 1:
            ax.annotate(
                str(number), _xy(z), ha="center", va="center", zorder=7, color=OUTSIDE, fontweight="bold"
            )


def _enlarged(ax: Axes, problem: PlanningProblem, z: FloatArray, bodies: frozenset[str]) -> None:
    draw_workspace(ax, problem.workspace)
    ax.set_facecolor(WALL)
    for footprint in team_footprints(problem.tree, z):
        faulty = footprint.name in bodies
        fill, edge = (AT_FAULT, AT_FAULT) if faulty else (NOT_AT_FAULT, GREY)
        draw_polygon(ax, footprint.shape, facecolor=fill, edgecolor="none", alpha=0.65, zorder=3)
        draw_polygon(ax, footprint.shape, facecolor="none", edgecolor=edge, linewidth=1.0, zorder=4)
        outside = footprint.shape.difference(problem.workspace)
        for part in parts_of(outside):
            draw_polygon(ax, part, facecolor=OUTSIDE, edgecolor=OUTSIDE, linewidth=1.5, zorder=5)
    reach = max(_reach(problem, z), 0.5) + BORDER
    ax.set_xlim(z[0] - reach, z[0] + reach)
    ax.set_ylim(z[1] - reach, z[1] + reach)


def _reach(problem: PlanningProblem, z: FloatArray) -> float:
    """How far the team reaches from the object's origin at a configuration [m]."""
    centre = Point(z[:2])
    return max(centre.hausdorff_distance(footprint.shape) for footprint in team_footprints(problem.tree, z))


def _mark_gap(ax: Axes, passage: BlockingPassage) -> str:
    """Draw the two wall points, the width between them and what is missing; returns the title."""
    gap = passage.stretch.gap
    missing = f"{2.0 * passage.enough:.3f} m more is enough"
    if gap is None:
        return missing
    ax.annotate(
        "",
        _xy(gap.second),
        xytext=_xy(gap.first),
        arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0},
        zorder=7,
    )
    ax.plot(*np.array([gap.first, gap.second]).T, "o", color=OUTSIDE, markersize=7, zorder=8)
    ax.annotate(
        f"{gap.width:.3f} m\n+ {2.0 * passage.enough:.3f} m",
        _xy(0.5 * (gap.first + gap.second)),
        ha="center",
        va="center",
        zorder=9,
        fontweight="bold",
        bbox={"boxstyle": "round,pad=0.25", "facecolor": PAPER, "edgecolor": INK, "linewidth": 0.8},
    )
    return f"{gap.width:.3f} m wide, {missing}"


def _xy(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
