"""Every figure of a run, written into one directory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.files import write_atomically
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.viz import floor_figures, time_figures
from coop_drake.viz.figure_names import joints_figure_name
from coop_drake.viz.time_axes import TimeAxes


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
            self._time_axes = TimeAxes(time_figures.panel_counts(tree))

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
    yield "fig06_position", partial(time_figures.position_figure, log, axes)
    yield "fig07_angle", partial(time_figures.angle_figure, log, axes)
    curves = partial(time_figures.curves_figure, log, axes)
    twist, wrench = log.object_twist, log.object_wrench
    caption = "Figure 8. Linear velocity of the object."
    yield "fig08_velocity", partial(curves, caption, twist[:, :2], "x velocity [m/s]", "y velocity [m/s]")
    caption = "Figure 9. Angular velocity of the object."
    yield "fig09_angular_velocity", partial(curves, caption, twist[:, 2:], "angular velocity [rad/s]")
    for robot, name in enumerate(log.robot_names):
        draw = partial(time_figures.joints_figure, tree, log, robot, axes)
        yield joints_figure_name(robot, name), draw
    caption = "Figure 12. Total force that the robots apply to the object."
    yield "fig12_force", partial(curves, caption, wrench[:, :2], "x force [N]", "y force [N]")
    caption = "Figure 13. Total torque that the robots apply to the object, about its centre of mass."
    yield "fig13_torque", partial(curves, caption, wrench[:, 2:], "torque [N m]")
    yield "summary", partial(time_figures.summary_figure, log, axes)
