"""Figures of effort and of margins over time: the paper's Figures 12 and 13, and a summary."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from coop_drake.drawing.canvas import legend_above
from coop_drake.drawing.colours import BLUE, GREEN, INK, OBJECT, ORANGE, robot_colour
from coop_drake.simulation import SimulationLog
from coop_drake.viz.time_axes import SWITCHES, mark_switches, switch_times, time_axes

__all__ = ["force_figure", "summary_figure", "torque_figure"]


def force_figure(log: SimulationLog) -> Figure:
    """Draw the total force that the robots apply to the object over time."""
    caption = f"Figure 12. Total force that the robots apply to the object. {SWITCHES}"
    figure, axes = time_axes(caption, ["$F_x$ [N]", "$F_y$ [N]"])
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.object_wrench[:, axis], color=OBJECT)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def torque_figure(log: SimulationLog) -> Figure:
    """Draw the total torque that the robots apply to the object over time."""
    caption = (
        f"Figure 13. Total torque that the robots apply to the object, about its centre of mass. {SWITCHES}"
    )
    figure, axes = time_axes(caption, ["torque [N m]"], height=3.0)
    axes[0].plot(log.times, log.object_wrench[:, 2], color=OBJECT)
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure


def summary_figure(log: SimulationLog) -> Figure:
    """Draw the invariants' margins, which must stay above zero, and the bases' forces over time."""
    caption = (
        "Summary. Distance of the team to the walls, between bodies, and of the object to its cell's "
        "boundary; energy margin of the governor; force of every base. Margins must stay above zero. "
        f"{SWITCHES}"
    )
    figure, axes = time_axes(caption, ["clearance [m]", "energy margin ΔE [m²/s²]", "base force [N]"])
    for clearance, colour, label in (
        (log.workspace_clearance, BLUE, "team to walls"),
        (log.body_clearance, GREEN, "between bodies"),
        (log.cell_clearance, ORANGE, "object to its cell's boundary"),
    ):
        axes[0].plot(log.times, clearance, color=colour, linewidth=1.0, label=label)
    legend_above(axes[0])
    axes[1].plot(log.times, log.energy_margin, color=OBJECT, linewidth=1.0)
    axes[0].axhline(0.0, color=INK, linewidth=0.8)
    if log.energy_margin.min() > 0.0:
        axes[1].set_yscale("log")
    else:
        axes[1].set_yscale("symlog", linthresh=1e-3)
        axes[1].axhline(0.0, color=INK, linewidth=0.8)
    for robot, name in enumerate(log.robot_names):
        force = np.hypot(log.base_wrenches[:, robot, 0], log.base_wrenches[:, robot, 1])
        axes[2].plot(log.times, force, color=robot_colour(robot), linewidth=1.0, label=name)
    legend_above(axes[2])
    mark_switches(axes, switch_times(log.times, log.cell_index))
    return figure
