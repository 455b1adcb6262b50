"""What is asked and what is planned, on the floor: bodies at start and goal, and the channel between them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from coop_drake.drawing.canvas import legend_above, new_figure
from coop_drake.drawing.colours import INK, SKY
from coop_drake.drawing.floor import draw_polygon, draw_team, draw_workspace, team_legend
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.plan import Plan
from coop_drake.planning.problem import PlanningProblem

__all__ = ["overview_figure"]

_TALLEST, _LOWEST = 8.0, 3.0  # [inches]


def overview_figure(problem: PlanningProblem, plan: Plan | None = None, caption: str = "") -> Figure:
    """Draw a question, and its plan if there is one.

    Args:
        problem: Floor, team, start and goal. Joints that the goal leaves free are drawn as the plan ends with
            them, or as they start.
        plan: Its cells are drawn as regions of the object's position, its targets as dots on a line.
        caption: Text under the picture.
    """
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    aspect = (y_max - y_min) / (x_max - x_min)
    height = min(_TALLEST, max(_LOWEST, 7.0 * aspect))
    figure = new_figure(min(11.0, max(5.0, height / aspect + 1.0)), height + 0.8, caption)
    ax = figure.subplots()
    draw_workspace(ax, problem.workspace)
    handles = team_legend(problem.tree)
    if plan is not None:
        handles.append(Patch(facecolor=SKY, edgecolor=SKY, alpha=0.5, label="channel"))
        _draw_channel(ax, plan)
    legend_above(ax, handles)
    for label, z in (("start", problem.start), ("goal", _at_goal(problem, plan))):
        draw_team(ax, problem.tree, z, alpha=0.55 if label == "start" else 0.3)
        ax.plot(z[0], z[1], "o", color=INK, markersize=3, zorder=5)
        ax.annotate(
            label, (z[0], z[1]), xytext=(5, 4), textcoords="offset points", zorder=6, fontweight="bold"
        )
    return figure


def _draw_channel(ax: Axes, plan: Plan) -> None:
    for cell in plan.cells:
        draw_polygon(ax, cell.tidied, facecolor=SKY, edgecolor="none", alpha=0.25, zorder=2)
        draw_polygon(ax, cell.tidied, facecolor="none", edgecolor=SKY, linewidth=0.7, zorder=2.1)
    way = np.array([plan.start[:2], *(transition.target for transition in plan.transitions)])
    ax.plot(way[:, 0], way[:, 1], ".-", color=INK, linewidth=0.8, markersize=4, zorder=2.2)


def _at_goal(problem: PlanningProblem, plan: Plan | None) -> FloatArray:
    """(x, y, theta, q...) at the goal, shape (3 + n,)."""
    free = problem.start[3:]
    if plan is not None:
        free = 0.5 * (plan.transitions[-1].goal_lower + plan.transitions[-1].goal_upper)[1:]
    joints = [rest if goal is None else goal for goal, rest in zip(problem.goal_joints, free, strict=True)]
    return np.concatenate([problem.goal_pose, joints])
