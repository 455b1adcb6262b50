"""The floor with the team on it where a transport begins and where it ends."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.drawing.canvas import new_figure
from coop_drake.drawing.colours import INK
from coop_drake.drawing.floor import draw_team, draw_workspace
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

__all__ = ["at_goal", "draw_ends", "floor_figure", "joints_at_end"]

_TALLEST, _LOWEST = 9.0, 3.0  # [inches]
_WIDEST, _NARROWEST = 11.0, 5.0  # [inches]
_ACROSS = 6.0  # Width that a floor gets if neither bounds it [inches].


def floor_figure(workspace: Polygon, caption: str) -> tuple[Figure, Axes]:
    """Return a figure whose axes show the floor, about as tall and wide as that is."""
    x_min, y_min, x_max, y_max = workspace.bounds
    aspect = (y_max - y_min) / (x_max - x_min)
    height = min(_TALLEST, max(_LOWEST, _ACROSS * aspect))
    figure = new_figure(min(_WIDEST, max(_NARROWEST, height / aspect + 1.2)), height + 0.8, caption)
    ax = figure.subplots()
    draw_workspace(ax, workspace)
    return figure, ax


def draw_ends(ax: Axes, tree: ComponentTree, start: FloatArray, goal: FloatArray) -> None:
    """Draw the team at both ends and name them.

    Args:
        ax: Where to draw.
        tree: The team.
        start: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        goal: The same in the end.
    """
    for label, z in (("start", start), ("goal", goal)):
        draw_team(ax, tree, z)
        ax.plot(z[0], z[1], "o", color=INK, markersize=3, zorder=5)
        ax.annotate(
            label, (z[0], z[1]), xytext=(5, 4), textcoords="offset points", zorder=6, fontweight="bold"
        )


def at_goal(asked: PlanningProblem | Plan, free: FloatArray) -> FloatArray:
    """Return z = (x, y, theta, q...) at the goal, shape (3 + n,), joints left free as ``free`` says, (n,)."""
    joints = [rest if goal is None else goal for goal, rest in zip(asked.goal_joints, free, strict=True)]
    return np.concatenate([asked.goal_pose, joints])


def joints_at_end(plan: Plan) -> FloatArray:
    """Return the middle of the last goal interval of every joint, shape (n,) [rad or m]."""
    last = plan.transitions[-1]
    middle: FloatArray = 0.5 * (last.goal_lower + last.goal_upper)[1:]
    return middle
