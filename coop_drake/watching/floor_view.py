"""The left half of a frame: the floor, what is known about it, and the channel on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from coop_drake.answers.problem import PlanningProblem
from coop_drake.drawing import draw_team, draw_workspace
from coop_drake.drawing.colours import INK
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching import look
from coop_drake.watching.way import Leg

__all__ = ["DASHES", "draw_ends", "draw_legs", "draw_outline", "draw_section"]

DASHES = (0.0, (1.4, 0.9))
"""How what is not proved is dashed."""


def draw_ends(ax: Axes, problem: PlanningProblem, goal_joints: FloatArray) -> None:
    """Draw the floor, and the team's footprint at the start and at the goal.

    Args:
        ax: Where to draw.
        problem: The question.
        goal_joints: Joint values to draw the goal with, shape (n,) [rad, m].
    """
    draw_workspace(ax, problem.workspace)
    goal = np.concatenate([problem.goal_pose, goal_joints])
    for label, z in (("start", problem.start), ("goal", goal)):
        draw_team(ax, problem.tree, z, colour=INK, alpha=0.12, zorder=5.0)
        ax.annotate(
            label,
            (z[0], z[1]),
            ha="center",
            va="center",
            fontsize=10,
            fontweight="bold",
            zorder=8,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
        )


def draw_section(ax: Axes, section: CrossSection, colour: str, alpha: float, zorder: float = 2.0) -> None:
    """Fill a section, holes left open, with a thin outline."""
    outline = _outline(section)
    if outline is None:
        return
    ax.add_patch(PathPatch(outline, facecolor=colour, edgecolor="none", alpha=alpha, zorder=zorder))
    ax.add_patch(PathPatch(outline, facecolor="none", edgecolor=colour, linewidth=0.8, zorder=zorder))


def draw_outline(ax: Axes, section: CrossSection, colour: str) -> None:
    """Draw the boundary of a section boldly."""
    outline = _outline(section)
    if outline is not None:
        ax.add_patch(PathPatch(outline, facecolor="none", edgecolor=colour, linewidth=2.0, zorder=4.0))


def _outline(section: CrossSection) -> Outline | None:
    rings = [np.asarray(ring) for ring in section.to_polygons()]
    if not rings:
        return None
    return Outline.make_compound_path(*(Outline(np.vstack([r, r[:1]]), closed=True) for r in rings))


def draw_legs(ax: Axes, legs: Sequence[Leg]) -> None:
    """Draw the line through a channel: firm where proved free, dashed where not."""
    for leg in legs:
        proved = leg.kind is Kind.FREE
        ax.plot(
            *leg.positions.T,
            color=look.CHANNEL if proved else look.OPEN_CHANNEL,
            linewidth=2.6,
            linestyle="-" if proved else DASHES,
            solid_capstyle="round",
            zorder=6.0 if proved else 6.5,
        )
