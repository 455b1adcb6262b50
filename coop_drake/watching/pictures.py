"""Pictures of keyframes: the floor, slices at angles of the object, and what is known of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import IO, Any

import numpy as np
import shapely
from manifold3d import CrossSection
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.ticker import MaxNLocator
from PIL import Image

from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.drawing import colours
from coop_drake.drawing.canvas import draw_polygon, draw_team, draw_workspace, outline_of, save_figure
from coop_drake.drawing.colours import PAPER
from coop_drake.files import write_atomically
from coop_drake.geometry.polygons import parts_of
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.graph import Kind
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.watching.keyframes import THETA, Components, Keyframe, PathPiece, on_turn, union
from coop_drake.watching.recording import ChannelCell, Leaf, SearchRecording

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


# The right half of a keyframe's figure: how theta and every joint are cut into slices.


_FILLED, _TINT = 0.5, 0.35
"""Opacities of slices, and of the channel's slices over them: the path and what is halved stand out."""


def cut(leaves: Iterable[Leaf], axis: int, point: FloatArray) -> list[Leaf]:
    """Return the leaves that a plane of theta and one joint meets; other joints have the point's values.

    The joint's axis is 1 or more; 0 keeps theta alone. The point is (theta, q...), shape (1 + n,) [rad, m].
    """
    leaves = list(leaves)
    others = [other for other in range(1, len(point)) if other != axis]
    limits = {other: max(leaf.intervals[other][1] for leaf in leaves) for other in others if leaves}
    return [
        leaf
        for leaf in leaves
        if all(_holds(leaf.intervals[other], float(point[other]), limits[other]) for other in others)
    ]


def _holds(interval: Interval, value: float, limit: float) -> bool:
    """Return whether an interval holds a value; of two that meet there the upper one does."""
    return interval[0] <= value < interval[1] or value >= interval[1] == limit


def leaf_colour(leaf: Leaf) -> str:
    """Return the colour of a leaf: blocked, undecided, or the darker the more of it is proved free."""
    free = leaf.free_fraction
    if free is None:
        return colours.BLOCKED
    return colours.UNDECIDED if free == 0.0 else colours.blend(colours.PARTLY_FREE, colours.PROVED_FREE, free)


class AnglePanel:
    """Draws slices as rectangles over theta and one joint.

    Args:
        ax: Where to draw.
        axis: The joint's axis among the exploration's (theta, q...); 0 draws strips over theta alone.
        limits: Limits of that joint [rad or m], or of the strips.
        circular: Whether the joint is a circle.
    """

    def __init__(self, ax: Axes, axis: int, limits: Interval, *, circular: bool = False) -> None:
        self._ax, self._axis, self._limits, self._circular = ax, axis, limits, circular

    def draw_leaves(self, leaves: Sequence[Leaf], fills: Sequence[str]) -> None:
        """Fill the rectangle of every leaf with its colour."""
        parts = [(part, fill) for leaf, fill in zip(leaves, fills, strict=True) for part in self._parts(leaf)]
        rectangles, colour_of = [part for part, _ in parts], [fill for _, fill in parts]
        self._add(rectangles, facecolors=colour_of, edgecolors=colours.PAPER, linewidths=0.3, alpha=_FILLED)

    def hatch(self, leaves: Sequence[Leaf], colour: str) -> None:
        """Hatch the rectangle of every leaf."""
        rectangles = [part for leaf in leaves for part in self._parts(leaf)]
        self._add(rectangles, facecolors="none", edgecolors=colour, linewidths=0.0, hatch="////")

    def draw_channel(self, channel: Sequence[ChannelCell]) -> None:
        """Tint the slices of a channel, whatever the values of the joints left out."""
        for proved, colour in ((True, colours.PROVED_FREE), (False, colours.UNDECIDED_CHANNEL)):
            cells = [cell for cell in channel if (cell.kind is Kind.FREE) == proved]
            parts = [shapely.box(x0, y0, x1, y1) for cell in cells for x0, y0, x1, y1 in self._boxes(cell)]
            for part in parts_of(shapely.union_all(parts)):
                draw_polygon(self._ax, part, facecolor=colour, edgecolor="none", alpha=_TINT, zorder=3)

    def draw_splits(self, splits: Sequence[tuple[Leaf, int]]) -> None:
        """Frame the slice that was halved last, with the line that halves it."""
        if not splits:
            return
        leaf, halved = splits[-1]
        frame = {"facecolors": "none", "edgecolors": colours.HALVED, "linewidths": 2.0, "zorder": 4}
        self._add(self._parts(leaf), **frame)
        if halved in (0, self._axis):
            (x0, x1), (y0, y1) = leaf.intervals[0], self._upright(leaf.intervals)
            x, y = THETA[0] + (0.5 * (x0 + x1) - THETA[0]) % (2 * pi), 0.5 * (y0 + y1)
            line = [(x, y0), (x, y1)] if halved == 0 else [(x0, y), (x1, y)]
            halving = LineCollection([line], colors=colours.HALVED, linewidths=2.0, zorder=4)
            self._ax.add_collection(halving, autolim=False)

    def draw_angles(self, path: Sequence[PathPiece]) -> None:
        """Draw how theta and the joint move along a channel: firm where it is proved free, dashed where not.

        The line is broken where theta, or a joint that is a circle, leaves the turn drawn.
        """
        for piece in path if self._axis else ():
            theta = THETA[0] + np.mod(piece.angles[:, 0] - THETA[0], 2 * pi)
            upright, turn = piece.angles[:, self._axis], np.abs(np.diff(theta))
            if self._circular:
                upright = self._limits[0] + np.mod(upright - self._limits[0], 2 * pi)
                turn = np.maximum(turn, np.abs(np.diff(upright)))
            jumps = np.flatnonzero(turn > pi) + 1
            draw_piece(self._ax, piece, np.insert(np.array([theta, upright]), jumps, np.nan, axis=1))

    def _parts(self, slice_: Leaf | ChannelCell) -> list[list[tuple[float, float]]]:
        """Return the corners of a slice, in two parts where it crosses the end of the turn drawn."""
        return [[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, y0, x1, y1 in self._boxes(slice_)]

    def _boxes(self, slice_: Leaf | ChannelCell) -> list[tuple[float, float, float, float]]:
        """Return the least and largest theta and joint position of a slice's parts."""
        y0, y1 = self._upright(slice_.intervals)
        return [(x0, y0, x1, y1) for x0, x1 in on_turn(slice_.intervals[0])]

    def _upright(self, intervals: Intervals) -> Interval:
        """Return the interval of the joint that is drawn upwards."""
        return intervals[self._axis] if self._axis else self._limits

    def _add(self, rectangles: list[list[tuple[float, float]]], **style: Any) -> None:
        self._ax.add_collection(PolyCollection(rectangles, **style), autolim=False)


# The figure of a keyframe: the floor on the left, the subdivision on the right, progress below it.


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
    below = f"{frame.state.question}  ·  {frame.counters}"
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


# Pictures of a recorded search: one per keyframe, a sheet of a few of them, and a moving picture.


_ON_SHEET, _SHEET_COLUMNS = 6, 2
"""Number of pictures on the sheet, and of its columns."""

_MOVING_WIDTH = 960
"""Width of the moving picture [pixels]: three quarters of the pictures', which keeps the file small."""

_COLOURS = 64
"""Number of colours of the moving picture."""

_SHOWN, _LAST_SHOWN = 240, 4000
"""How long the moving picture shows a keyframe, and the last one with the verdict [ms]."""


def write_pictures(
    recording: SearchRecording, frames: Sequence[Keyframe], directory: Path, progress: Progress | None = None
) -> list[Path]:
    """Write ``think_0001.png`` and so on, a sheet ``think.png``, and a moving picture ``think.gif``.

    Returns:
        The files written, pictures first, then sheet and moving picture.
    """
    histories = {frame.state.question: frame.state.history for frame in frames}
    pictures = []
    for number, frame in enumerate(frames, start=1):
        if progress is not None:
            progress(f"picture {number}", (number - 1) / len(frames))
        path = directory / f"think_{number:04d}.png"
        save_figure(keyframe_figure(recording, frame, histories[frame.state.question]), path, dpi=100)
        pictures.append(path)
    sheet = _write_sheet([pictures[index] for index in on_sheet(frames)], directory / "think.png")
    return [*pictures, sheet, _write_moving(pictures, directory / "think.gif")]


def on_sheet(frames: Sequence[Keyframe]) -> list[int]:
    """Return the indices of a few keyframes: the first, the last, and others evenly by the slices made."""
    made = np.array([frame.state.slices for frame in frames])
    questions = [frame.state.question for frame in frames]
    begun = np.cumsum([0, *[first != second for first, second in pairwise(questions)]])
    work = made + begun * made.max()
    wanted = np.linspace(work[0], work[-1], min(_ON_SHEET, len(frames)))[1:-1]
    between = [int(np.abs(work - one).argmin()) for one in wanted]
    return sorted({0, *between, len(frames) - 1})


def _write_sheet(pictures: Sequence[Path], path: Path) -> Path:
    images = [_opened(picture) for picture in pictures]
    width, height = images[0].size
    columns = min(_SHEET_COLUMNS, len(images))
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * width, rows * height), PAPER)
    for number, image in enumerate(images):
        sheet.paste(image, (number % columns * width, number // columns * height))
    return write_atomically(path, lambda file: sheet.save(file, "PNG", optimize=True))


def _write_moving(pictures: Sequence[Path], path: Path) -> Path:
    images = []
    for picture in pictures:
        image = _opened(picture)
        size = (_MOVING_WIDTH, round(image.height * _MOVING_WIDTH / image.width))
        small = image.resize(size, Image.Resampling.LANCZOS)
        images.append(small.quantize(_COLOURS, dither=Image.Dither.NONE))
    durations = [_SHOWN] * (len(images) - 1) + [_LAST_SHOWN]

    def save(file: IO[bytes]) -> None:
        images[0].save(file, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0)

    return write_atomically(path, save)


def _opened(path: Path) -> Image.Image:
    with Image.open(path) as image:
        return image.convert("RGB")
