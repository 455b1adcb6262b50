"""Figures on the floor plan: question and plan, start and goal (Figure 4), path and footprints (Figure 5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.drawing.canvas import legend_above, new_figure
from coop_drake.drawing.colours import INK, OUTSIDE, SKY
from coop_drake.drawing.floor import draw_polygon, draw_team, draw_workspace, frame_of, team_legend
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

_TALLEST, _LOWEST = 9.0, 3.0
"""Limits of a floor's height on the page [in]."""

_WIDEST, _NARROWEST = 11.0, 4.5
"""Limits of a floor's width on the page [in]."""

_WIDTH = 6.0
"""Width of a floor whose height is within its limits [in]."""

_OPACITIES = (0.12, 0.55)
"""Opacity of the first and of the last footprint along a path."""

_FOOTPRINTS = 10
"""Number of footprints drawn along a path, start and end included."""

_TURNING = 0.3
"""Metres of the path that one radian of turning counts as, when footprints are spread along it [m/rad]."""


def overview_figure(problem: PlanningProblem, plan: Plan | None = None, caption: str = "") -> Figure:
    """Draw a planning problem, and its plan if there is one, with a caption below.

    Joints that the goal leaves free are drawn as the plan ends with them, or as they start. The plan's cells
    are regions of the object's position, its targets dots on a line.
    """
    figure, ax = _floor_axes(problem.workspace, caption)
    handles = team_legend(problem.tree)
    if plan is not None:
        handles.append(Patch(facecolor=SKY, edgecolor=SKY, alpha=0.5, label="cells"))
        _draw_cells(ax, plan)
    legend_above(ax, handles)
    free = problem.start[3:] if plan is None else _joints_at_end(plan)
    goal = at_goal(problem.goal_pose, problem.goal_joints, free)
    _draw_ends(ax, problem.tree, problem.start, goal)
    return figure


def refused_figure(problem: PlanningProblem, plan: Plan) -> Figure:
    """Draw a plan that limits refuse, and the team in the cells that break them most."""
    broken = "; ".join(refusal.describe() for refusal in plan.refused_by)
    figure = overview_figure(
        problem, plan, f"A way exists; the dark red team is where limits refuse it. {broken}."
    )
    ax = figure.axes[0]
    for refusal in plan.refused_by:
        transition = plan.transitions[refusal.cell]
        axes = 0.5 * (transition.goal_lower + transition.goal_upper)
        draw_team(ax, problem.tree, np.concatenate([transition.target, axes]), colour=OUTSIDE, zorder=4.0)
        _label(ax, refusal.limit, transition.target, color=OUTSIDE)
    return figure


def start_and_goal_figure(workspace: Polygon, tree: ComponentTree, plan: Plan) -> Figure:
    """Draw the team at the start and at the goal of a plan.

    Joints without a goal value are drawn in the middle of the last cell's goal interval.
    """
    caption = "Figure 4. Start and goal configuration of the robots and the object."
    figure, ax = _floor_axes(workspace, caption)
    legend_above(ax, team_legend(tree))
    goal = at_goal(plan.goal_pose, plan.goal_joints, _joints_at_end(plan))
    _draw_ends(ax, tree, plan.start, goal)
    return figure


def path_figure(workspace: Polygon, tree: ComponentTree, log: SimulationLog) -> Figure:
    """Draw the object's path, and the team's footprint in its colours at instants spread evenly along it."""
    caption = (
        "Figure 5. Path of the object (black line) and footprints of object and robots along it, the later "
        "the darker; the numbers are times [s]."
    )
    figure, ax = _floor_axes(workspace, caption)
    rows = _rows_along(log)
    for row, alpha in zip(rows, np.linspace(*_OPACITIES, len(rows)), strict=True):
        draw_team(ax, tree, np.concatenate([log.object_pose[row], log.joints[row]]), alpha=alpha)
    ax.plot(log.object_pose[:, 0], log.object_pose[:, 1], color=INK, linewidth=1.4, zorder=5)
    for row in rows:
        ax.plot(*log.object_pose[row, :2], "o", color=INK, markersize=3, zorder=5)
        ax.annotate(
            f"{log.times[row]:.1f}",
            tuple(log.object_pose[row, :2].tolist()),
            xytext=(4, 2),
            textcoords="offset points",
            fontsize=7.5,
            zorder=6,
        )
    legend_above(ax, team_legend(tree))
    return figure


def _floor_axes(workspace: Polygon, caption: str) -> tuple[Figure, Axes]:
    """Return a figure whose axes show the floor and are just as large."""
    x_min, y_min, x_max, y_max = frame_of(workspace)
    aspect = (y_max - y_min) / (x_max - x_min)
    height = min(_TALLEST, max(_LOWEST, _WIDTH * aspect))
    width = min(_WIDEST, max(_NARROWEST, height / aspect))
    margins = (0.65, 0.15, 0.3)
    figure = new_figure(width + margins[0] + margins[1], height + margins[2] + 0.8, caption, margins=margins)
    ax = figure.subplots()
    draw_workspace(ax, workspace)
    return figure, ax


def _draw_ends(ax: Axes, tree: ComponentTree, start: FloatArray, goal: FloatArray) -> None:
    """Draw the team at both ends, z = (x, y, theta, q...) of shape (3 + n,) [m, rad], and name them."""
    for label, z in (("start", start), ("goal", goal)):
        draw_team(ax, tree, z)
        ax.plot(z[0], z[1], "o", color=INK, markersize=3, zorder=5)
        _label(ax, label, z)


def _label(ax: Axes, label: str, position: FloatArray, **style: Any) -> None:
    """Write a word beside a position (x, y) [m]."""
    place = (float(position[0]), float(position[1]))
    ax.annotate(label, place, xytext=(5, 4), textcoords="offset points", zorder=6, fontweight="bold", **style)


def _joints_at_end(plan: Plan) -> FloatArray:
    """Return the middle of the last goal interval of every joint, shape (n,) [rad or m]."""
    last = plan.transitions[-1]
    return 0.5 * (last.goal_lower + last.goal_upper)[1:]


def _draw_cells(ax: Axes, plan: Plan) -> None:
    """Draw the region of every cell, and a line through the targets."""
    for cell in plan.cells:
        draw_polygon(ax, cell.tidied, facecolor=SKY, edgecolor="none", alpha=0.25, zorder=2)
        draw_polygon(ax, cell.tidied, facecolor="none", edgecolor=SKY, linewidth=0.7, zorder=2.1)
    targets = np.array([plan.start[:2], *(transition.target for transition in plan.transitions)])
    ax.plot(targets[:, 0], targets[:, 1], ".-", color=INK, linewidth=0.8, markersize=4, zorder=2.2)


def _rows_along(log: SimulationLog) -> NDArray[np.intp]:
    """Return rows of the log that are spread evenly along the path, in metres plus weighted radians."""
    steps = np.abs(np.diff(np.hstack([log.object_pose, log.joints]), axis=0))
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + _TURNING * steps[:, 2:].max(axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    spread = np.linspace(0.0, travelled[-1], _FOOTPRINTS)
    return np.unique(np.searchsorted(travelled, spread).clip(0, len(steps)))
