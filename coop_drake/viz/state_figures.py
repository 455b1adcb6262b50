"""Figures of the state over time: the paper's Figures 6 to 11."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coop_drake.geometry.tree import ComponentTree
from coop_drake.simulation import SimulationLog
from coop_drake.viz.canvas import break_at, legend_above, mark_switches, switch_times, time_axes
from coop_drake.viz.colours import BLUE, GREY, INK, OBJECT, SKY, robot_colour

__all__ = ["angle_figure", "angular_velocity_figure", "joints_figure", "position_figure", "velocity_figure"]

_SWITCHES = "Dashed lines mark the switches from cell to cell."


def position_figure(log: SimulationLog) -> Figure:
    """Draw the object's position and the governor's over time."""
    caption = f"Figure 6. Position of the object, and of the reference governor that leads it. {_SWITCHES}"
    figure, axes = time_axes(caption, ["x [m]", "y [m]"])
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.governor_position[:, axis], color=GREY, linewidth=0.9, label="governor")
        ax.plot(log.times, log.object_pose[:, axis], color=BLUE, label="object")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def angle_figure(log: SimulationLog) -> Figure:
    """Draw the object's angle inside its funnel over time."""
    caption = f"Figure 7. Angle of the object between the walls of its funnel. {_SWITCHES}"
    figure, axes = time_axes(caption, ["theta [rad]"], height=3.0)
    _draw_funnel(axes[0], log, 0)
    axes[0].plot(log.times, log.object_pose[:, 2], color=OBJECT, label="theta")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def velocity_figure(log: SimulationLog) -> Figure:
    """Draw the object's linear velocity over time."""
    figure, axes = time_axes(
        f"Figure 8. Linear velocity of the object. {_SWITCHES}", ["v_x [m/s]", "v_y [m/s]"]
    )
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.object_twist[:, axis], color=BLUE)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def angular_velocity_figure(log: SimulationLog) -> Figure:
    """Draw the object's angular velocity over time."""
    caption = f"Figure 9. Angular velocity of the object. {_SWITCHES}"
    figure, axes = time_axes(caption, ["w [rad/s]"], height=3.0)
    axes[0].plot(log.times, log.object_twist[:, 2], color=OBJECT)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def joints_figure(tree: ComponentTree, log: SimulationLog, robot: int) -> Figure | None:
    """Draw the joints of one robot inside their funnels over time; None for a robot without joints."""
    joints = [joint for joint in tree.joints if joint.robot == robot]
    if not joints:
        return None
    name = log.robot_names[robot]
    caption = (
        f"Figure {min(10 + robot, 11)}. Joints of {name} between the walls of their funnels. {_SWITCHES}"
    )
    labels = [
        f"{joint.name.split('::')[-1]} [{'rad' if joint.kind == 'revolute' else 'm'}]" for joint in joints
    ]
    figure, axes = time_axes(caption, labels, height=3.0 if len(joints) == 1 else 2.1)
    for joint, ax in zip(joints, axes, strict=True):
        _draw_funnel(ax, log, 1 + joint.index)
        ax.plot(log.times, log.joints[:, joint.index], color=robot_colour(robot), label="joint")
    legend_above(axes[0])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def _draw_funnel(ax: Axes, log: SimulationLog, axis: int) -> None:
    times, lower = break_at(log.times, log.funnel_lower[:, axis], log.cell_index)
    _, upper = break_at(log.times, log.funnel_upper[:, axis], log.cell_index)
    ax.fill_between(times, lower, upper, color=SKY, alpha=0.25, linewidth=0, label="funnel")
    for wall in (lower, upper):
        ax.plot(times, wall, color=INK, linewidth=0.7)
