"""Every figure of a run, written into one directory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.plan import Plan
from coop_drake.drawing.canvas import house_style, save_figure
from coop_drake.simulation import SimulationLog
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.viz import floor_figures, time_figures

__all__ = ["write_figures"]


def write_figures(
    workspace: Polygon, tree: ComponentTree, plan: Plan, log: SimulationLog, directory: Path
) -> list[Path]:
    """Write figures 4 to 13 of the paper for this run, and a summary of the margins, as PNG.

    Figures 10 and 11 show one robot each; those of further robots are called Figure 11, too.

    Args:
        workspace: The floor [m].
        tree: The team's component tree.
        plan: What was executed.
        log: What happened.
        directory: Existing directory to write into.

    Returns:
        The files written, in order.
    """
    written = []
    with house_style():
        for name, figure in _figures(workspace, tree, plan, log):
            written.append(directory / f"{name}.png")
            save_figure(figure, written[-1])
    return written


def _figures(
    workspace: Polygon, tree: ComponentTree, plan: Plan, log: SimulationLog
) -> Iterator[tuple[str, Figure]]:
    yield "fig04_start_and_goal", floor_figures.start_and_goal_figure(workspace, tree, plan)
    yield "fig05_path", floor_figures.path_figure(workspace, tree, log)
    yield "fig06_position", time_figures.position_figure(log)
    yield "fig07_angle", time_figures.angle_figure(log)
    yield "fig08_velocity", time_figures.velocity_figure(log)
    yield "fig09_angular_velocity", time_figures.angular_velocity_figure(log)
    for robot, name in enumerate(log.robot_names):
        figure = time_figures.joints_figure(tree, log, robot)
        if figure is not None:
            yield f"fig{min(10 + robot, 11)}_joints_{name}", figure
    yield "fig12_force", time_figures.force_figure(log)
    yield "fig13_torque", time_figures.torque_figure(log)
    yield "summary", time_figures.summary_figure(log)
