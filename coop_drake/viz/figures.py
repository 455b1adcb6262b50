"""The figures of a run: the paper's Figures 4 to 13, and a summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.speeds import base_speeds
from coop_drake.drawing.canvas import DPI, house_style, legend_above, picture_of, set_margins
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, OBJECT, SKY, robot_colour
from coop_drake.files import write_atomically
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.viz import floor_figures
from coop_drake.viz.figure_names import joints_figure_name

# Axes over the time of a run: stacked panels, marks where the next cell is entered, lines broken there.

_WIDTH = 7.5
"""Width of a figure [in]: that of a page of text."""

_MARGINS = (0.82, 0.15, 0.32)
"""Space at the left for tick labels and an axis label, at the right, and at the top for a legend [in]."""

_SINGLE, _SEVERAL = 2.7, 1.8
"""Height of the panel of a figure that has only one, and of one among several [in]."""

_GAP = 0.28
"""Space between two panels [in]: a legend fits."""

_TICKED = (0.0, 8.5)
"""Limits of axes that are made ahead, in any unit: they get nine ticks, the most that an axis has."""


class TimeAxes:
    """Makes figures with panels over a common axis of time.

    Some can be made ahead, before there is a log: most of the time that it takes to draw a curve goes into
    ticks, which a figure makes when it is drawn first.

    Args:
        counts: Of every figure that is made ahead its number of panels.
    """

    def __init__(self, counts: Iterable[int] = ()) -> None:
        self._ahead = [(count, *_blank(count)) for count in counts]
        for _, figure, axes in self._ahead:
            for ax in axes:
                ax.set(xlim=_TICKED, ylim=_TICKED)
            figure.set_dpi(DPI)
            figure.canvas.draw()
            for ax in axes:
                ax.set_autoscale_on(True)

    def __call__(
        self,
        log: SimulationLog,
        caption: str,
        labels: list[str],
        *,
        height: float | None = None,
        switches: bool = True,
    ) -> tuple[Figure, list[Axes]]:
        """Return a figure with one panel per label, stacked over the axis of time, each of some height [in].

        A dashed vertical line marks every switch to the next cell, and the caption says so, unless
        ``switches`` is false.
        """
        count = len(labels)
        height = height or (_SINGLE if count == 1 else _SEVERAL)
        if switches:
            caption = f"{caption} Dashed lines mark the switches from cell to cell."
        figure, axes = self._taken(count) or _blank(count)
        figure.set_size_inches(_WIDTH, count * (height + _GAP) + 1.0)
        set_margins(figure, caption, _MARGINS)
        figure.subplots_adjust(hspace=_GAP / height)
        marked = log.times[1:][np.diff(log.cell_index) != 0] if switches else []
        for ax, label in zip(axes, labels, strict=True):
            ax.set_ylabel(label)
            ax.vlines(
                marked,
                0.0,
                1.0,
                transform=ax.get_xaxis_transform(),
                colors=GREY,
                linewidths=0.5,
                linestyles=(0, (4, 3)),
                zorder=0.5,
            )
        axes[0].set_xlim(0.0, max(float(log.times[-1]), 1e-9))
        axes[-1].set_xlabel("time [s]")
        return figure, list(axes)

    def _taken(self, count: int) -> tuple[Figure, list[Axes]] | None:
        """A figure that was made ahead, if there is one with so many panels; each is used once."""
        found = next((entry for entry in self._ahead if entry[0] == count), None)
        if found is None:
            return None
        self._ahead.remove(found)
        return found[1], found[2]


def _blank(count: int) -> tuple[Figure, list[Axes]]:
    """A figure with so many empty panels over a common axis."""
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


def break_at_switches(log: SimulationLog, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a line that is broken at every switch, so that a jump is not drawn as a slope.

    Times [s] and values, shape (T,), get one more entry at every switch: a NaN before the new cell's first
    value.
    """
    places = np.flatnonzero(np.diff(log.cell_index)) + 1
    return np.insert(log.times, places, log.times[places]), np.insert(values.astype(float), places, np.nan)


# Figures of a run over time: the paper's Figures 6 to 13, and a summary of clearances, speeds and forces.

_NONE_AHEAD = TimeAxes()
"""Axes of which none are made before there is a log."""


def panel_counts(tree: ComponentTree) -> list[int]:
    """Numbers of panels of all figures over time in a run of a team, in no order that matters."""
    robots = Counter(joint.robot for joint in tree.joints)
    return [2, 2, 2, 1, *robots.values(), 2, 1, 3]


def position_figure(log: SimulationLog, time_axes: TimeAxes = _NONE_AHEAD) -> Figure:
    """Draw the object's position and the reference governor's over time."""
    caption = "Figure 6. Position of the object, and of the reference governor that leads it."
    figure, axes = time_axes(log, caption, ["x [m]", "y [m]"])
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.governor_position[:, axis], color=GREY, linewidth=0.9, label="governor")
        ax.plot(log.times, log.object_pose[:, axis], color=OBJECT, label="object")
    legend_above(axes[0])
    return figure


def angle_figure(log: SimulationLog, time_axes: TimeAxes = _NONE_AHEAD) -> Figure:
    """Draw the object's angle inside its funnel over time, and both measured from the funnel's middle."""
    caption = "Figure 7. Angle of the object between the bounds of its funnel; below, both measured from the "
    labels = ["θ [rad]", "θ, from the middle [rad]"]
    figure, axes = time_axes(log, f"{caption}funnel's middle.", labels, height=2.3)
    middle = 0.5 * (log.funnel_lower[:, 0] + log.funnel_upper[:, 0])
    for ax, origin in zip(axes, (np.zeros_like(middle), middle), strict=True):
        _draw_funnel(ax, log, 0, origin)
        ax.plot(*break_at_switches(log, log.object_pose[:, 2] - origin), color=OBJECT, label="θ")
    legend_above(axes[0])
    return figure


def joints_figure(
    tree: ComponentTree, log: SimulationLog, robot: int, time_axes: TimeAxes = _NONE_AHEAD
) -> Figure | None:
    """Draw the joints of one robot inside their funnels over time; None for a robot without joints."""
    joints = [joint for joint in tree.joints if joint.robot == robot]
    if not joints:
        return None
    name = log.robot_names[robot]
    caption = f"Figure {min(10 + robot, 11)}. Joints of {name} between the bounds of their funnels."
    labels = [f"{joint.name.split('::')[-1]} [{joint.unit}]" for joint in joints]
    figure, axes = time_axes(log, caption, labels)
    for joint, ax in zip(joints, axes, strict=True):
        _draw_funnel(ax, log, 1 + joint.index, np.zeros_like(log.times))
        ax.plot(log.times, log.joints[:, joint.index], color=robot_colour(robot), label="joint")
    legend_above(axes[0])
    return figure


def summary_figure(log: SimulationLog, time_axes: TimeAxes = _NONE_AHEAD) -> Figure:
    """Draw the clearances, which must stay above zero, the speeds and the bases' forces over time."""
    caption = (
        "Summary. Smallest distance of the team to the walls and between bodies; speed of the object and of "
        "the fastest base; force of the base with the largest one."
    )
    labels = ["clearance [m]", "speed [m/s]", "base force [N]"]
    figure, (clearances, speeds, forces) = time_axes(log, caption, labels, switches=False)
    times, moved = base_speeds(log)
    object_speed = np.hypot(log.object_twist[:, 0], log.object_twist[:, 1])
    strongest = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1]).max(axis=1)
    for ax, at, values, colour, label in (
        (clearances, log.times, log.workspace_clearance, BLUE, "team to walls"),
        (clearances, log.times, log.body_clearance, GREEN, "between bodies"),
        (speeds, times, moved[..., 0].max(axis=1, initial=0.0), INK, "fastest base"),
        (speeds, log.times, object_speed, OBJECT, "object"),
        (forces, log.times, strongest, INK, "largest of all bases"),
    ):
        ax.plot(at, values, color=colour, linewidth=1.0, label=label)
    for ax in (clearances, speeds, forces):
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0] if ax.dataLim.y0 < 0.0 else 0.0))
        legend_above(ax)
    return figure


def curves_figure(
    log: SimulationLog, time_axes: TimeAxes, caption: str, values: FloatArray, *labels: str
) -> Figure:
    """Draw one curve of the object over time in every panel; values of shape (T, panels)."""
    figure, axes = time_axes(log, caption, list(labels))
    for ax, curve in zip(axes, values.T, strict=True):
        ax.plot(log.times, curve, color=OBJECT)
    return figure


def _draw_funnel(ax: Axes, log: SimulationLog, axis: int, origin: FloatArray) -> None:
    """Draw both bounds of one axis' funnel, measured from an origin that may move, shape (T,)."""
    times, lower = break_at_switches(log, log.funnel_lower[:, axis] - origin)
    _, upper = break_at_switches(log, log.funnel_upper[:, axis] - origin)
    ax.fill_between(times, lower, upper, color=SKY, alpha=0.25, linewidth=0, label="funnel")
    for bound in (lower, upper):
        ax.plot(times, bound, color=INK, linewidth=0.7)


# Every figure of a run, written into one directory.


def write_figures(
    workspace: Polygon, tree: ComponentTree, plan: Plan, log: SimulationLog, directory: Path
) -> list[Path]:
    """Write figures 4 to 13 of the paper and a summary of the margins as PNG; return the files written.

    Figures 10 and 11 show one robot each; those of further robots are called Figure 11, too.
    """
    return RunFigures(workspace, tree, plan).write(log, directory)


class RunFigures:
    """The figures of a run. What the plan and the team alone show is drawn at once."""

    def __init__(self, workspace: Polygon, tree: ComponentTree, plan: Plan) -> None:
        self._workspace, self._tree = workspace, tree
        with house_style():
            self._start_and_goal = picture_of(floor_figures.start_and_goal_figure(workspace, tree, plan))
            self._time_axes = TimeAxes(panel_counts(tree))

    def write(
        self, log: SimulationLog, directory: Path, *, numbers: Iterable[int] | None = None
    ) -> list[Path]:
        """Write the figures of a run as `write_figures` does.

        Where several processes write them, each gets the ``numbers`` of those that it shall write.
        """
        written = []
        known = list(self._figures(log))
        with house_style():
            for name, draw in known if numbers is None else (known[number] for number in numbers):
                figure = draw()
                if figure is not None:
                    picture = figure if isinstance(figure, bytes) else picture_of(figure)
                    written.append(write_atomically(directory / f"{name}.png", picture))
        return written

    def names(self, log: SimulationLog) -> list[str]:
        """Names of the figures of a run, in the order of their numbers, from 0."""
        return [name for name, _ in self._figures(log)]

    def _figures(self, log: SimulationLog) -> Iterator[tuple[str, Callable[[], Figure | bytes | None]]]:
        yield "fig04_start_and_goal", lambda: self._start_and_goal
        yield from _figures(self._workspace, self._tree, log, self._time_axes)


def _figures(
    workspace: Polygon, tree: ComponentTree, log: SimulationLog, axes: TimeAxes
) -> Iterator[tuple[str, Callable[[], Figure | None]]]:
    """Name every figure of a log, with what draws it; a robot without joints has none of them."""
    yield "fig05_path", partial(floor_figures.path_figure, workspace, tree, log)
    yield "fig06_position", partial(position_figure, log, axes)
    yield "fig07_angle", partial(angle_figure, log, axes)
    curves = partial(curves_figure, log, axes)
    twist, wrench = log.object_twist, log.object_wrench
    caption = "Figure 8. Linear velocity of the object."
    yield "fig08_velocity", partial(curves, caption, twist[:, :2], "x velocity [m/s]", "y velocity [m/s]")
    caption = "Figure 9. Angular velocity of the object."
    yield "fig09_angular_velocity", partial(curves, caption, twist[:, 2:], "angular velocity [rad/s]")
    for robot, name in enumerate(log.robot_names):
        draw = partial(joints_figure, tree, log, robot, axes)
        yield joints_figure_name(robot, name), draw
    caption = "Figure 12. Total force that the robots apply to the object."
    yield "fig12_force", partial(curves, caption, wrench[:, :2], "x force [N]", "y force [N]")
    caption = "Figure 13. Total torque that the robots apply to the object, about its centre of mass."
    yield "fig13_torque", partial(curves, caption, wrench[:, 2:], "torque [N m]")
    yield "summary", partial(summary_figure, log, axes)
