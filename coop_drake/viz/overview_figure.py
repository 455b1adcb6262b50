"""What is asked and what is planned, on the floor: bodies at start and goal, and the channel between them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.drawing.canvas import legend_above
from coop_drake.drawing.colours import INK, SKY
from coop_drake.drawing.floor import draw_polygon, team_legend
from coop_drake.viz.ends import at_goal, draw_ends, floor_figure, joints_at_end

__all__ = ["overview_figure"]


def overview_figure(problem: PlanningProblem, plan: Plan | None = None, caption: str = "") -> Figure:
    """Draw a question, and its plan if there is one.

    Args:
        problem: Floor, team, start and goal. Joints that the goal leaves free are drawn as the plan ends with
            them, or as they start.
        plan: Its cells are drawn as regions of the object's position, its targets as dots on a line.
        caption: Text under the picture.
    """
    figure, ax = floor_figure(problem.workspace, caption)
    handles = team_legend(problem.tree)
    if plan is not None:
        handles.append(Patch(facecolor=SKY, edgecolor=SKY, alpha=0.5, label="channel"))
        _draw_channel(ax, plan)
    legend_above(ax, handles)
    free = problem.start[3:] if plan is None else joints_at_end(plan)
    draw_ends(ax, problem.tree, problem.start, at_goal(problem, free))
    return figure


def _draw_channel(ax: Axes, plan: Plan) -> None:
    for cell in plan.cells:
        draw_polygon(ax, cell.tidied, facecolor=SKY, edgecolor="none", alpha=0.25, zorder=2)
        draw_polygon(ax, cell.tidied, facecolor="none", edgecolor=SKY, linewidth=0.7, zorder=2.1)
    way = np.array([plan.start[:2], *(transition.target for transition in plan.transitions)])
    ax.plot(way[:, 0], way[:, 1], ".-", color=INK, linewidth=0.8, markersize=4, zorder=2.2)
