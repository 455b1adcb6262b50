"""Figures on the floor plan: start and goal (the paper's Figure 4), path and footprints (Figure 5)."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.plan import Plan
from coop_drake.drawing.canvas import legend_above
from coop_drake.drawing.colours import VERMILLION
from coop_drake.drawing.floor import draw_team, team_legend
from coop_drake.simulation import SimulationLog
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.ends import at_goal, draw_ends, floor_figure, joints_at_end

__all__ = ["path_figure", "start_and_goal_figure"]

_FOOTPRINTS = 14  # Footprints drawn along the path, start and end included.


def start_and_goal_figure(workspace: Polygon, tree: ComponentTree, plan: Plan) -> Figure:
    """Draw the team at the start and at the goal of a plan.

    Joints without a goal value are drawn in the middle of the last cell's goal interval.
    """
    caption = "Figure 4. Start and goal configuration of the robots and the object."
    figure, ax = floor_figure(workspace, caption)
    legend_above(ax, team_legend(tree))
    draw_ends(ax, tree, plan.start, at_goal(plan, joints_at_end(plan)))
    return figure


def path_figure(workspace: Polygon, tree: ComponentTree, log: SimulationLog) -> Figure:
    """Draw the object's path, and the team's footprint at instants spread evenly along it."""
    caption = "Figure 5. Path of the object (red) and footprints of the team along it, coloured by time."
    figure, ax = floor_figure(workspace, caption)
    colours = mpl.colormaps["cividis"]
    scale = Normalize(float(log.times[0]), float(log.times[-1]))
    for row in _instants(log):
        z = np.concatenate([log.object_pose[row], log.joints[row]])
        draw_team(ax, tree, z, colour=colours(scale(log.times[row])), alpha=0.35)
    ax.plot(log.object_pose[:, 0], log.object_pose[:, 1], color=VERMILLION, linewidth=1.8, zorder=5)
    figure.colorbar(ScalarMappable(scale, colours), ax=ax, label="time [s]", shrink=0.6)
    return figure


def _instants(log: SimulationLog) -> FloatArray:
    """Return rows of the log that lie evenly along the way, in metres plus radians."""
    steps = np.abs(np.diff(np.hstack([log.object_pose, log.joints]), axis=0))
    travelled = np.concatenate(
        [[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]) + 0.3 * steps[:, 2:].max(axis=1))]
    )
    return np.unique(
        np.searchsorted(travelled, np.linspace(0.0, travelled[-1], _FOOTPRINTS)).clip(0, len(steps))
    )
