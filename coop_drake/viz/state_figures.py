"""Figures of the state over time: the paper's Figures 6 to 11."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coop_drake.drawing.canvas import legend_above
from coop_drake.drawing.colours import GREY, INK, OBJECT, SKY, robot_colour
from coop_drake.simulation import SimulationLog
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.time_axes import SWITCHES, break_at, mark_switches, switch_times, time_axes

__all__ = ["angle_figure", "angular_velocity_figure", "joints_figure", "position_figure", "velocity_figure"]


def position_figure(log: SimulationLog) -> Figure:
    """Draw the object's position and the governor's over time."""
    caption = f"Figure 6. Position of the object, and of the reference governor that leads it. {SWITCHES}"
    figure, axes = time_axes(caption, ["x [m]", "y [m]"])
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.governor_position[:, axis], color=GREY, linewidth=0.9, label="governor")
        ax.plot(log.times, log.object_pose[:, axis], color=OBJECT, label="object")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def angle_figure(log: SimulationLog) -> Figure:
    """Draw the object's angle inside its funnel over time, and both again seen from the funnel's middle."""
    caption = (
        "Figure 7. Angle of the object between the walls of its funnel; below, both measured from the "
        f"funnel's middle. {SWITCHES}"
    )
    figure, axes = time_axes(caption, ["θ [rad]", "θ, from the middle [rad]"], height=2.6)
    middle = 0.5 * (log.funnel_lower[:, 0] + log.funnel_upper[:, 0])
    for ax, origin in zip(axes, (np.zeros_like(middle), middle), strict=True):
        _draw_funnel(ax, log, 0, origin)
        times, theta = break_at(log.times, log.object_pose[:, 2] - origin, log.cell_index)
        ax.plot(times, theta, color=OBJECT, label="θ")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def velocity_figure(log: SimulationLog) -> Figure:
    """Draw the object's linear velocity over time."""
    figure, axes = time_axes(
        f"Figure 8. Linear velocity of the object. {SWITCHES}", ["$v_x$ [m/s]", "$v_y$ [m/s]"]
    )
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.object_twist[:, axis], color=OBJECT)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def angular_velocity_figure(log: SimulationLog) -> Figure:
    """Draw the object's angular velocity over time."""
    caption = f"Figure 9. Angular velocity of the object. {SWITCHES}"
    figure, axes = time_axes(caption, ["ω [rad/s]"], height=3.0)
    axes[0].plot(log.times, log.object_twist[:, 2], color=OBJECT)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def joints_figure(tree: ComponentTree, log: SimulationLog, robot: int) -> Figure | None:
    """Draw the joints of one robot inside their funnels over time; None for a robot without joints."""
    joints = [joint for joint in tree.joints if joint.robot == robot]
    if not joints:
        return None
    name = log.robot_names[robot]
    caption = f"Figure {min(10 + robot, 11)}. Joints of {name} between the walls of their funnels. {SWITCHES}"
    labels = [f"{joint.name.split('::')[-1]} [{joint.unit}]" for joint in joints]
    figure, axes = time_axes(caption, labels, height=3.0 if len(joints) == 1 else 2.1)
    for joint, ax in zip(joints, axes, strict=True):
        _draw_funnel(ax, log, 1 + joint.index, np.zeros_like(log.times))
        ax.plot(log.times, log.joints[:, joint.index], color=robot_colour(robot), label="joint")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def _draw_funnel(ax: Axes, log: SimulationLog, axis: int, origin: FloatArray) -> None:
    """Draw both walls of one axis' funnel, measured from an origin that may move, shape (T,)."""
    times, lower = break_at(log.times, log.funnel_lower[:, axis] - origin, log.cell_index)
    _, upper = break_at(log.times, log.funnel_upper[:, axis] - origin, log.cell_index)
    ax.fill_between(times, lower, upper, color=SKY, alpha=0.25, linewidth=0, label="funnel")
    for wall in (lower, upper):
        ax.plot(times, wall, color=INK, linewidth=0.7)
