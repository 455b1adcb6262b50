"""The figure of a keyframe: the floor on the left, the subdivision on the right, progress below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from coop_drake.answers.problem import at_goal
from coop_drake.drawing import colours
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.angle_panels import AnglePanel, cut, leaf_colour
from coop_drake.watching.components import Components
from coop_drake.watching.floor_panel import DASHES, draw_ends, draw_path, draw_section
from coop_drake.watching.keyframes import Keyframe
from coop_drake.watching.projections import union
from coop_drake.watching.recording import SearchRecording
from coop_drake.watching.search_states import Leaf
from coop_drake.watching.theta_layers import THETA

_SIZE = (12.8, 7.2)
"""Width and height of the figure [in]: 1280 by 720 pixels."""

_FLOOR = "The floor: positions of the object, for some choice of the angles"
_ANGLES = "The angles: slices of θ and of each joint, cut at the last one halved"
_TICKS = ((0.0, "0"), (np.pi / 2, "π/2"), (np.pi, "π"), (3 * np.pi / 2, "3π/2"))
_STRIPS = (0.0, 1.0)  # Limits between which strips are drawn if theta is the only axis.


def keyframe_figure(
    recording: SearchRecording, frame: Keyframe, history: Sequence[tuple[int, int]]
) -> Figure:
    """Draw one keyframe of a recorded search.

    ``history`` has slices made and undecided cells on the channel at every search of this exploration, also
    of those to come.
    """
    figure = Figure(figsize=_SIZE, dpi=100)
    FigureCanvasAgg(figure)
    figure.text(0.02, 0.955, frame.headline, fontsize=15, fontweight="bold", va="center", color=colours.INK)
    margin = "" if recording.margin == 0.0 else f", {recording.margin:g} m from the walls"
    below = f"{frame.state.question}{margin}  ·  {frame.counters}"
    figure.text(0.02, 0.915, below, fontsize=10, va="center", color=colours.GREY)
    _draw_floor(figure.add_axes((0.05, 0.175, 0.43, 0.68)), recording, frame)
    axes = recording.axes_of(frame.state.robots)
    panels = range(1, len(axes)) or range(1)  # Theta against every joint, or theta alone.
    height = (0.855 - 0.265) / len(panels)
    for row, own in enumerate(panels):
        ax = figure.add_axes((0.57, 0.855 - (row + 1) * height + 0.012, 0.41, height - 0.024))
        _draw_angles(ax, recording, frame, own, last=own == panels[-1])
    _draw_history(figure.add_axes((0.57, 0.075, 0.41, 0.11)), frame, history)
    figure.text(0.57, 0.867, _ANGLES, fontsize=10)
    figure.legend(
        handles=_legend(frame),
        loc="lower left",
        bbox_to_anchor=(0.015, -0.005),
        ncols=3,
        frameon=False,
        fontsize=9,
    )
    return figure


def _legend(frame: Keyframe) -> list[Patch | Line2D]:
    blocked = Patch(color=colours.BLOCKED, alpha=0.75, label="blocked")
    if frame.components is not None:
        reached, others = colours.REACHED, colours.UNREACHED
        both = "angles at which there are both"
        return [
            Patch(color=reached, alpha=0.6, label="may be reached from the start"),
            Patch(color=others, alpha=0.6, label="cannot be reached"),
            Patch(facecolor=reached, edgecolor=others, hatch="////", alpha=0.6, label=both),
            blocked,
        ]
    dashed = Line2D([], [], color=colours.UNDECIDED_CHANNEL, linewidth=2.6, label="channel, undecided")
    dashed.set_linestyle(DASHES)
    return [
        Patch(color=colours.PROVED_FREE, alpha=0.6, label="proved free"),
        Patch(color=colours.GUIDE, alpha=0.45, label="free in the middle of a slice"),
        Patch(color=colours.UNDECIDED, alpha=0.6, label="undecided"),
        blocked,
        Line2D([], [], color=colours.CHANNEL, linewidth=2.6, label="channel, proved"),
        dashed,
        Patch(facecolor="none", edgecolor=colours.HALVED, linewidth=2.0, label="halved now"),
    ]


def _draw_floor(ax: Axes, recording: SearchRecording, frame: Keyframe) -> None:
    draw_ends(ax, recording.problem, _goal(recording, frame))
    ax.set_title(_FLOOR, fontsize=10, loc="left")
    if frame.components is not None:
        draw_section(ax, union(region for _, region in frame.components.reached), colours.REACHED, 0.5)
        draw_section(ax, union(region for _, region in frame.components.others), colours.UNREACHED, 0.5)
        return
    draw_section(ax, frame.projection.mixed, colours.UNDECIDED, 0.5)
    draw_section(ax, frame.projection.guide, colours.GUIDE, 0.45)
    draw_section(ax, frame.projection.free, colours.PROVED_FREE, 0.5)
    draw_path(ax, frame.path)
    if frame.state.splits and frame.state.verdict is None:
        last = frame.state.splits[-1][0].slice
        for cell in frame.state.channel:
            if cell.slice == last:
                draw_section(ax, cell.region.section, colours.HALVED, 0.0, width=2.0)


def _goal(recording: SearchRecording, frame: Keyframe) -> FloatArray:
    """Return z at the goal; free joints are as at the end of the path, else as at the start."""
    joints = recording.problem.start[3:].copy()
    if frame.path:
        axes = recording.axes_of(frame.state.robots)[1:]
        joints[[axis - 1 for axis in axes]] = frame.path[-1].angles[-1, 1:]
    return at_goal(recording.problem.goal_pose, recording.problem.goal_joints, joints)


def _draw_angles(ax: Axes, recording: SearchRecording, frame: Keyframe, own: int, *, last: bool) -> None:
    """Draw the cut through the subdivision along theta and one of the exploration's axes (0: theta alone)."""
    axis = recording.axes_of(frame.state.robots)[own]
    ax.set_xlim(*THETA)
    ax.set_xticks([value for value, _ in _TICKS], [label if last else "" for _, label in _TICKS])
    ax.tick_params(labelsize=8)
    if last:
        ax.set_xlabel("θ [rad]", labelpad=0)
    limits = _STRIPS
    if axis:
        joint = recording.problem.tree.joints[axis - 1]
        limits = joint.range
        name = recording.axis_names[axis].replace(" ", "\n", 1)
        ax.set_ylabel(f"{name} [{joint.unit}]", fontsize=9)
    else:
        ax.set_yticks([])
    ax.set_ylim(*limits)
    leaves = cut(frame.state.leaves.values(), own, frame.cut_at)
    panel = AnglePanel(ax, own, limits, circular=axis > 0 and recording.problem.tree.circular[axis])
    if frame.components is not None:
        _draw_components(panel, frame.components, leaves)
        return
    panel.draw_leaves(leaves, [leaf_colour(leaf) for leaf in leaves])
    if frame.state.verdict is None:
        panel.draw_splits(frame.state.splits)
    panel.draw_channel(frame.state.channel)
    panel.draw_angles(frame.path)


def _draw_components(panel: AnglePanel, components: Components, leaves: Sequence[Leaf]) -> None:
    """Fill leaves by whether they may be reached from the start; hatch those of which only a part may be."""
    reached, others = ({leaf.slice for leaf, _ in part} for part in (components.reached, components.others))
    fills = [
        colours.REACHED
        if leaf.slice in reached
        else colours.UNREACHED
        if leaf.slice in others
        else colours.BLOCKED
        for leaf in leaves
    ]
    panel.draw_leaves(leaves, fills)
    panel.hatch([leaf for leaf in leaves if leaf.slice in reached & others], colours.UNREACHED)


def _draw_history(ax: Axes, frame: Keyframe, history: Sequence[tuple[int, int]]) -> None:
    """Draw how many cells of the channel are undecided at every search, with the present one marked."""
    ax.tick_params(labelsize=8)
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_xlabel("slices made", fontsize=9, labelpad=1)
    ax.set_ylabel("undecided\non channel", fontsize=9)
    if not history:
        return
    made, undecided = np.array(history).T
    ax.step(made, undecided, where="post", color=colours.UNDECIDED, alpha=0.35, linewidth=1.5)
    ax.set_ylim(0, max(1.0, 1.05 * float(undecided.max())))
    ax.yaxis.set_major_locator(MaxNLocator(3, integer=True))
    past = frame.state.history
    if past:
        ax.step(*np.array(past).T, where="post", color=colours.UNDECIDED_CHANNEL, linewidth=1.8)
        ax.plot(*past[-1], "o", color=colours.UNDECIDED_CHANNEL, markersize=5, clip_on=False)
