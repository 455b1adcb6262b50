"""One frame of the figure sequence: floor on the left, subdivision on the right, progress below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from coop_drake.drawing.colours import GREY, INK
from coop_drake.tree.pose import FloatArray
from coop_drake.watching import look
from coop_drake.watching.axes_view import (
    cut,
    draw_angles,
    draw_channel_tiles,
    draw_hatch,
    draw_looked_at,
    draw_tiles,
    leaf_colour,
)
from coop_drake.watching.components import Parts
from coop_drake.watching.film import Film
from coop_drake.watching.floor_view import DASHES, draw_ends, draw_legs, draw_outline, draw_section
from coop_drake.watching.moments import Leaf
from coop_drake.watching.shadows import union
from coop_drake.watching.stack import THETA
from coop_drake.watching.storyboard import Shot

__all__ = ["frame_figure"]

_SIZE = (12.8, 7.2)  # Inches, a hundred points each.
_SINGLE = (0.0, 1.0)  # Where strips are drawn if theta is the only axis.
_FLOOR = "The floor: positions of the object, for some choice of the angles"
_ANGLES = "The angles: slices of θ and of each joint, cut where it looks"
_TICKS = ((0.0, "0"), (np.pi / 2, "π/2"), (np.pi, "π"), (3 * np.pi / 2, "3π/2"))


def frame_figure(film: Film, shot: Shot, story: Sequence[tuple[int, int]]) -> Figure:
    """Draw one moment.

    Args:
        film: The film.
        shot: The moment.
        story: Slices made and undecided cells on the channel at every search of this exploration, also of
            those to come.
    """
    figure = Figure(figsize=_SIZE, dpi=100)
    FigureCanvasAgg(figure)
    figure.text(0.02, 0.955, shot.headline, fontsize=15, fontweight="bold", va="center", color=INK)
    asked = "" if film.margin == 0.0 else f", {film.margin:g} m from the walls"
    below = f"{shot.moment.question}{asked}  ·  {shot.counters}"
    figure.text(0.02, 0.915, below, fontsize=10, va="center", color=GREY)
    _draw_floor(figure.add_axes((0.05, 0.175, 0.43, 0.68)), film, shot)
    axes = film.axes_of(shot.moment.robots)
    panels = range(1, len(axes)) or range(1)  # Theta against every joint, or theta alone.
    height = (0.855 - 0.265) / len(panels)
    for row, own in enumerate(panels):
        ax = figure.add_axes((0.57, 0.855 - (row + 1) * height + 0.012, 0.41, height - 0.024))
        _draw_panel(ax, film, shot, own, last=own == panels[-1])
    _draw_story(figure.add_axes((0.57, 0.075, 0.41, 0.11)), shot, story)
    figure.text(0.57, 0.867, _ANGLES, fontsize=10)
    figure.legend(
        handles=_legend(shot),
        loc="lower left",
        bbox_to_anchor=(0.015, -0.005),
        ncols=3,
        frameon=False,
        fontsize=9,
    )
    return figure


def _legend(shot: Shot) -> list[Patch | Line2D]:
    if shot.parts is not None:
        return [
            Patch(color=look.REACHED, alpha=0.6, label="may be reached from the start"),
            Patch(color=look.OTHERS, alpha=0.6, label="cannot be reached"),
            Patch(
                facecolor=look.REACHED,
                edgecolor=look.OTHERS,
                hatch="////",
                alpha=0.6,
                label="angles at which there are both",
            ),
            Patch(color=look.BLOCKED, alpha=0.75, label="blocked"),
        ]
    return [
        Patch(color=look.FREE, alpha=0.6, label="proved free"),
        Patch(color=look.GUIDE, alpha=0.45, label="free in the middle of a slice"),
        Patch(color=look.MIXED, alpha=0.6, label="undecided"),
        Patch(color=look.BLOCKED, alpha=0.75, label="blocked"),
        Line2D([], [], color=look.CHANNEL, linewidth=2.6, label="channel, proved"),
        Line2D(
            [],
            [],
            color=look.OPEN_CHANNEL,
            linewidth=2.6,
            linestyle=DASHES,
            label="channel, undecided",
        ),
        Patch(facecolor="none", edgecolor=look.LOOKED_AT, linewidth=2.0, label="halved now"),
    ]


def _draw_floor(ax: Axes, film: Film, shot: Shot) -> None:
    draw_ends(ax, film.problem, _goal_joints(film, shot))
    ax.set_title(_FLOOR, fontsize=10, loc="left")
    if shot.parts is not None:
        draw_section(ax, union(region for _, region in shot.parts.reached), look.REACHED, 0.5)
        draw_section(ax, union(region for _, region in shot.parts.others), look.OTHERS, 0.5)
        return
    draw_section(ax, shot.shadow.mixed, look.MIXED, 0.5)
    draw_section(ax, shot.shadow.guide, look.GUIDE, 0.45)
    draw_section(ax, shot.shadow.free, look.FREE, 0.5)
    draw_legs(ax, shot.legs)
    if shot.moment.splits and shot.moment.verdict is None:
        last = shot.moment.splits[-1][0].slice
        for link in shot.moment.channel:
            if link.slice == last:
                draw_outline(ax, link.region.section, look.LOOKED_AT)


def _goal_joints(film: Film, shot: Shot) -> FloatArray:
    """Goal values of all joints; free joints as at the end of the channel, else as at the start."""
    joints = film.problem.start[3:].copy()
    if shot.legs:
        axes = film.axes_of(shot.moment.robots)[1:]
        joints[[axis - 1 for axis in axes]] = shot.legs[-1].angles[-1, 1:]
    fixed = film.problem.goal_joints
    return np.array([q if goal is None else goal for q, goal in zip(joints, fixed, strict=True)])


def _draw_panel(ax: Axes, film: Film, shot: Shot, own: int, *, last: bool) -> None:
    """Draw the cut through the subdivision along theta and one of the question's axes (0: theta alone)."""
    axis = film.axes_of(shot.moment.robots)[own]
    ax.set_xlim(*THETA)
    ax.set_xticks([value for value, _ in _TICKS], [label if last else "" for _, label in _TICKS])
    ax.tick_params(labelsize=8)
    if last:
        ax.set_xlabel("θ [rad]", labelpad=0)
    limits = _SINGLE
    if axis:
        joint = film.problem.tree.joints[axis - 1]
        limits = (joint.lower, joint.upper)
        name = film.axis_names[axis].replace(" ", "\n", 1)
        ax.set_ylabel(f"{name} [{joint.unit}]", fontsize=9)
    else:
        ax.set_yticks([])
    ax.set_ylim(*limits)
    shown = cut(shot.moment.leaves.values(), own, shot.looked_at)
    draw_tiles(ax, shown, own, _tile_colours(shot, shown), limits=limits)
    if shot.parts is not None:
        draw_hatch(ax, _in_both_parts(shot.parts, shown), own, look.OTHERS, limits=limits)
        return
    if shot.moment.verdict is None:
        draw_looked_at(ax, shot.moment.splits, own, limits=limits)
    draw_channel_tiles(ax, shot.moment.channel, own, limits=limits)
    draw_angles(ax, shot.legs, own)


def _tile_colours(shot: Shot, leaves: Sequence[Leaf]) -> list[str]:
    if shot.parts is None:
        return [leaf_colour(leaf) for leaf in leaves]
    reached = {leaf.slice for leaf, _ in shot.parts.reached}
    others = {leaf.slice for leaf, _ in shot.parts.others}
    return [
        look.REACHED if leaf.slice in reached else look.OTHERS if leaf.slice in others else look.BLOCKED
        for leaf in leaves
    ]


def _in_both_parts(parts: Parts, leaves: Sequence[Leaf]) -> list[Leaf]:
    reached, others = ({leaf.slice for leaf, _ in part} for part in (parts.reached, parts.others))
    return [leaf for leaf in leaves if leaf.slice in reached & others]


def _draw_story(ax: Axes, shot: Shot, story: Sequence[tuple[int, int]]) -> None:
    """Draw how many cells of the channel are undecided at every search, with the present moment marked."""
    ax.tick_params(labelsize=8)
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_xlabel("slices made", fontsize=9, labelpad=1)
    ax.set_ylabel("undecided\non channel", fontsize=9)
    if not story:
        return
    made, undecided = np.array(story).T
    ax.step(made, undecided, where="post", color=look.MIXED, alpha=0.35, linewidth=1.5)
    ax.set_ylim(0, max(1.0, 1.05 * float(undecided.max())))
    ax.yaxis.set_major_locator(MaxNLocator(3, integer=True))
    past = shot.moment.open_links
    if past:
        ax.step(*np.array(past).T, where="post", color=look.OPEN_CHANNEL, linewidth=1.8)
        ax.plot(*past[-1], "o", color=look.OPEN_CHANNEL, markersize=5, clip_on=False)
