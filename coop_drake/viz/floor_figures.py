"""Figures on the floor plan: question and plan, start and goal (Figure 4), path and footprints (Figure 5)."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.drawing.canvas import legend_above, new_figure
from coop_drake.drawing.colours import INK, SKY, VERMILLION
from coop_drake.drawing.floor import draw_polygon, draw_team, draw_workspace, frame_of, team_legend
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

_TALLEST, _LOWEST = 9.0, 3.0
"""Limits of a floor's height on the page [in]."""

_WIDEST, _NARROWEST = 11.0, 4.5
"""Limits of a floor's width on the page [in]."""

_WIDTH = 6.0
"""Width of a floor whose height is within its limits [in]."""

_COLOUR_BAR = 0.9
"""Width of the colour bar with its labels [in]."""

_FOOTPRINTS = 14
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
    """Draw the object's path, and the team's footprint at instants spread evenly along it."""
    caption = "Figure 5. Path of the object (red) and footprints of the team along it, coloured by time."
    figure, ax = _floor_axes(workspace, caption, right=_COLOUR_BAR)
    colours = mpl.colormaps["cividis"]
    scale = Normalize(float(log.times[0]), float(log.times[-1]))
    for row in _rows_along(log):
        z = np.concatenate([log.object_pose[row], log.joints[row]])
        draw_team(ax, tree, z, colour=colours(scale(log.times[row])), alpha=0.35)
    ax.plot(log.object_pose[:, 0], log.object_pose[:, 1], color=VERMILLION, linewidth=1.8, zorder=5)
    place, inch = ax.get_position(), 1.0 / figure.get_figwidth()
    beside = (place.x1 + 0.15 * inch, place.y0 + 0.2 * place.height, 0.2 * inch, 0.6 * place.height)
    figure.colorbar(ScalarMappable(scale, colours), cax=figure.add_axes(beside), label="time [s]")
    return figure


def _floor_axes(workspace: Polygon, caption: str, *, right: float = 0.15) -> tuple[Figure, Axes]:
    """Return a figure whose axes show the floor, are just as large, and leave space at their right [in]."""
    x_min, y_min, x_max, y_max = frame_of(workspace)
    aspect = (y_max - y_min) / (x_max - x_min)
    height = min(_TALLEST, max(_LOWEST, _WIDTH * aspect))
    width = min(_WIDEST, max(_NARROWEST, height / aspect))
    margins = (0.65, right, 0.3)
    figure = new_figure(width + margins[0] + right, height + margins[2] + 0.8, caption, margins=margins)
    ax = figure.subplots()
    draw_workspace(ax, workspace)
    return figure, ax


def _draw_ends(ax: Axes, tree: ComponentTree, start: FloatArray, goal: FloatArray) -> None:
    """Draw the team at both ends, z = (x, y, theta, q...) of shape (3 + n,) [m, rad], and name them."""
    for label, z in (("start", start), ("goal", goal)):
        draw_team(ax, tree, z)
        ax.plot(z[0], z[1], "o", color=INK, markersize=3, zorder=5)
        ax.annotate(
            label, (z[0], z[1]), xytext=(5, 4), textcoords="offset points", zorder=6, fontweight="bold"
        )


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
