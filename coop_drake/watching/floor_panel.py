"""The left half of a keyframe's figure: the floor, what is known about it, and the channel's path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.patches import PathPatch

from coop_drake.answers.problem import PlanningProblem
from coop_drake.drawing import colours
from coop_drake.drawing.floor import draw_team, draw_workspace, outline_of
from coop_drake.planning.cells.graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.channel_path import PathPiece

DASHES = (0.0, (1.4, 0.9))
"""Dashes of what is not proved, in widths of the line."""


def draw_ends(ax: Axes, problem: PlanningProblem, goal: FloatArray) -> None:
    """Draw the floor, and the team's footprint at the start and at z at the goal, shape (3 + n,)."""
    draw_workspace(ax, problem.workspace)
    box = {"boxstyle": "round,pad=0.15", "facecolor": colours.PAPER, "edgecolor": "none", "alpha": 0.8}
    for label, z in (("start", problem.start), ("goal", goal)):
        draw_team(ax, problem.tree, z, colour=colours.INK, alpha=0.12, zorder=5.0)
        ax.annotate(
            label, (z[0], z[1]), ha="center", va="center", fontsize=10, fontweight="bold", zorder=8, bbox=box
        )


def draw_section(ax: Axes, section: CrossSection, colour: str, alpha: float, *, width: float = 0.8) -> None:
    """Fill a section, holes left open, and draw its outline of a width [points].

    Opacity 0 draws the outline alone, above what is filled.
    """
    rings = [np.vstack([ring, ring[:1]]) for ring in section.to_polygons()]
    if rings:
        patch = PathPatch(
            outline_of(rings), facecolor=to_rgba(colour, alpha), edgecolor=colour, linewidth=width
        )
        patch.set_zorder(2.0 if alpha > 0.0 else 4.0)
        ax.add_patch(patch)


def draw_path(ax: Axes, path: Sequence[PathPiece]) -> None:
    """Draw the path through a channel: a firm line where it is proved free, a dashed one where not."""
    for piece in path:
        draw_piece(ax, piece, piece.positions.T)


def draw_piece(ax: Axes, piece: PathPiece, line: FloatArray) -> None:
    """Draw the path through one cell as a line of shape (2, k): firm if it is proved free, else dashed."""
    proved = piece.kind is Kind.FREE
    ax.plot(
        *line,
        color=colours.CHANNEL if proved else colours.UNDECIDED_CHANNEL,
        linewidth=2.6,
        linestyle="-" if proved else DASHES,
        solid_capstyle="round",
        zorder=6.0 if proved else 6.5,
    )
