"""Figures of a run over time: the paper's Figures 6 to 13, and a summary of clearances, speeds and forces."""

from __future__ import annotations

from collections import Counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.speeds import base_speeds
from coop_drake.drawing.canvas import legend_above
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, OBJECT, SKY, robot_colour
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.time_axes import TimeAxes, break_at_switches

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
