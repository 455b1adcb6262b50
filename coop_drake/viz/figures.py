"""Every figure of a run, written into one directory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.drawing.canvas import house_style, save_figure
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.viz import floor_figures, time_figures


def write_figures(
    workspace: Polygon,
    tree: ComponentTree,
    plan: Plan,
    log: SimulationLog,
    directory: Path,
    *,
    part: int = 0,
    parts: int = 1,
) -> list[Path]:
    """Write figures 4 to 13 of the paper for this run, and a summary of the margins, as PNG.

    Figures 10 and 11 show one robot each; those of further robots are called Figure 11, too.

    Args:
        workspace: The floor [m].
        tree: The team's component tree.
        plan: What was executed.
        log: What happened.
        directory: Existing directory to write into.
        part: Which part of the figures to write, where several processes write them.
        parts: Into how many parts they are divided.

    Returns:
        The files written, in order.
    """
    written = []
    with house_style():
        for name, draw in list(_figures(workspace, tree, plan, log))[part::parts]:
            figure = draw()
            if figure is not None:
                written.append(directory / f"{name}.png")
                save_figure(figure, written[-1])
    return written


def _figures(
    workspace: Polygon, tree: ComponentTree, plan: Plan, log: SimulationLog
) -> Iterator[tuple[str, Callable[[], Figure | None]]]:
    """Name every figure, with what draws it; a robot without joints has none of them."""
    yield "fig04_start_and_goal", partial(floor_figures.start_and_goal_figure, workspace, tree, plan)
    yield "fig05_path", partial(floor_figures.path_figure, workspace, tree, log)
    yield "fig06_position", partial(time_figures.position_figure, log)
    yield "fig07_angle", partial(time_figures.angle_figure, log)
    yield "fig08_velocity", partial(time_figures.velocity_figure, log)
    yield "fig09_angular_velocity", partial(time_figures.angular_velocity_figure, log)
    for robot, name in enumerate(log.robot_names):
        draw = partial(time_figures.joints_figure, tree, log, robot)
        yield f"fig{min(10 + robot, 11)}_joints_{name}", draw
    yield "fig12_force", partial(time_figures.force_figure, log)
    yield "fig13_torque", partial(time_figures.torque_figure, log)
    yield "summary", partial(time_figures.summary_figure, log)
