"""The figures of a run and of its floor: the paper's Figures 4 to 13, and a summary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.answers.speeds import base_speeds, steadiness
from coop_drake.drawing import canvas
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, OBJECT, OUTSIDE, SKY, robot_colour
from coop_drake.files import write_atomically
from coop_drake.planning.motion_limits import largest_forces
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification.runs.bodies import component_stages, moved
from coop_drake.viz.drawing_processes import joints_figure_name

# Figures on the floor plan: question and plan, start and goal (Figure 4), path and footprints (Figure 5).

_TALLEST, _LOWEST = 9.0, 3.0
"""Limits of a floor's height on the page [in]."""

_WIDEST, _NARROWEST = 11.0, 4.5
"""Limits of a floor's width on the page [in]."""

_FLOOR_WIDTH = 6.0
"""Width of a floor whose height is within its limits [in]."""

_OPACITIES = (0.12, 0.55)
"""Opacity of the first and of the last footprint along a path."""

_FOOTPRINTS = 10
"""Number of footprints drawn along a path, start and end included."""

_TURNING = 0.3
"""Metres of the path that one radian of turning counts as, when footprints are spread along it [m/rad]."""


def overview_figure(problem: PlanningProblem, plan: Plan | None = None, caption: str = "") -> Figure:
    """Draw a planning problem, and its plan if there is one, with a caption below.

    Joints that the goal leaves free are drawn as the plan ends with them, or as they start. The plan's cells
    are regions of the object's position, its targets dots on a line.
    """
    figure, ax = _floor_axes(problem.workspace, caption)
    handles = canvas.team_legend(problem.tree)
    if plan is not None:
        handles.append(Patch(facecolor=SKY, edgecolor=SKY, alpha=0.5, label="cells"))
        _draw_cells(ax, plan)
    canvas.legend_above(ax, handles)
    free = problem.start[3:] if plan is None else _joints_at_end(plan)
    goal = at_goal(problem.goal_pose, problem.goal_joints, free)
    _draw_ends(ax, problem.tree, problem.start, goal)
    return figure


def refused_figure(problem: PlanningProblem, plan: Plan) -> Figure:
    """Draw a plan that limits refuse, and the team in the cells that break them most."""
    broken = "; ".join(refusal.describe() for refusal in plan.refused_by)
    figure = overview_figure(
        problem, plan, f"A way exists; the dark red team is where limits refuse it. {broken}."
    )
    ax = figure.axes[0]
    for refusal in plan.refused_by:
        transition = plan.transitions[refusal.cell]
        axes = 0.5 * (transition.goal_lower + transition.goal_upper)
        canvas.draw_team(
            ax, problem.tree, np.concatenate([transition.target, axes]), colour=OUTSIDE, zorder=4.0
        )
        _label(ax, refusal.limit, transition.target, color=OUTSIDE)
    return figure


def start_and_goal_figure(workspace: Polygon, tree: ComponentTree, plan: Plan) -> Figure:
    """Draw the team at the start and at the goal of a plan.

    Joints without a goal value are drawn in the middle of the last cell's goal interval.
    """
    caption = "Figure 4. Start and goal configuration of the robots and the object."
    figure, ax = _floor_axes(workspace, caption)
    canvas.legend_above(ax, canvas.team_legend(tree))
    goal = at_goal(plan.goal_pose, plan.goal_joints, _joints_at_end(plan))
    _draw_ends(ax, tree, plan.start, goal)
    return figure


def path_figure(workspace: Polygon, tree: ComponentTree, log: SimulationLog) -> Figure:
    """Draw the object's path, and the team's footprint in its colours at instants spread evenly along it."""
    caption = (
        "Figure 5. Path of the object (black line) and footprints of object and robots along it, the later "
        "the darker; the numbers are times [s]."
    )
    figure, ax = _floor_axes(workspace, caption)
    rows = _rows_along(log)
    for row, alpha in zip(rows, np.linspace(*_OPACITIES, len(rows)), strict=True):
        canvas.draw_team(ax, tree, np.concatenate([log.object_pose[row], log.joints[row]]), alpha=alpha)
    ax.plot(log.object_pose[:, 0], log.object_pose[:, 1], color=INK, linewidth=1.4, zorder=5)
    for row in rows:
        ax.plot(*log.object_pose[row, :2], "o", color=INK, markersize=3, zorder=5)
        ax.annotate(
            f"{log.times[row]:.1f}",
            tuple(log.object_pose[row, :2].tolist()),
            xytext=(4, 2),
            textcoords="offset points",
            fontsize=7.5,
            zorder=6,
        )
    canvas.legend_above(ax, canvas.team_legend(tree))
    return figure


def _floor_axes(workspace: Polygon, caption: str) -> tuple[Figure, Axes]:
    """Return a figure whose axes show the floor and are just as large."""
    x_min, y_min, x_max, y_max = canvas.frame_of(workspace)
    aspect = (y_max - y_min) / (x_max - x_min)
    height = min(_TALLEST, max(_LOWEST, _FLOOR_WIDTH * aspect))
    width = min(_WIDEST, max(_NARROWEST, height / aspect))
    margins = (0.65, 0.15, 0.3)
    figure = canvas.new_figure(
        width + margins[0] + margins[1], height + margins[2] + 0.8, caption, margins=margins
    )
    ax = figure.subplots()
    canvas.draw_workspace(ax, workspace)
    return figure, ax


def _draw_ends(ax: Axes, tree: ComponentTree, start: FloatArray, goal: FloatArray) -> None:
    """Draw the team at both ends, z = (x, y, theta, q...) of shape (3 + n,) [m, rad], and name them."""
    for label, z in (("start", start), ("goal", goal)):
        canvas.draw_team(ax, tree, z)
        ax.plot(z[0], z[1], "o", color=INK, markersize=3, zorder=5)
        _label(ax, label, z)


def _label(ax: Axes, label: str, position: FloatArray, **style: Any) -> None:
    """Write a word beside a position (x, y) [m]."""
    place = (float(position[0]), float(position[1]))
    ax.annotate(label, place, xytext=(5, 4), textcoords="offset points", zorder=6, fontweight="bold", **style)


def _joints_at_end(plan: Plan) -> FloatArray:
    """Return the middle of the last goal interval of every joint, shape (n,) [rad or m]."""
    last = plan.transitions[-1]
    return 0.5 * (last.goal_lower + last.goal_upper)[1:]


def _draw_cells(ax: Axes, plan: Plan) -> None:
    """Draw the region of every cell, and a line through the targets."""
    for cell in plan.cells:
        canvas.draw_polygon(ax, cell.tidied, facecolor=SKY, edgecolor="none", alpha=0.25, zorder=2)
        canvas.draw_polygon(ax, cell.tidied, facecolor="none", edgecolor=SKY, linewidth=0.7, zorder=2.1)
    targets = np.array([plan.start[:2], *(transition.target for transition in plan.transitions)])
    ax.plot(targets[:, 0], targets[:, 1], ".-", color=INK, linewidth=0.8, markersize=4, zorder=2.2)


def _rows_along(log: SimulationLog) -> NDArray[np.intp]:
    """Return rows of the log that are spread evenly along the path, in metres plus weighted radians."""
    steps = np.abs(np.diff(np.hstack([log.object_pose, log.joints]), axis=0))
    lengths = np.hypot(steps[:, 0], steps[:, 1]) + _TURNING * steps[:, 2:].max(axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    spread = np.linspace(0.0, travelled[-1], _FOOTPRINTS)
    return np.unique(np.searchsorted(travelled, spread).clip(0, len(steps)))


# The figures of a run: the paper's Figures 4 to 13, and a summary.

# Axes over the time of a run: stacked panels, marks where the next cell is entered, lines broken there.

_WIDTH = 7.5
"""Width of a figure [in]: that of a page of text."""

_MARGINS = (0.82, 0.15, 0.32)
"""Space at the left for tick labels and an axis label, at the right, and at the top for a legend [in]."""

_SINGLE, _SEVERAL = 2.7, 1.8
"""Height of the panel of a figure that has only one, and of one among several [in]."""

_GAP = 0.28
"""Space between two panels [in]: a legend fits."""


def time_axes(
    log: SimulationLog,
    caption: str,
    labels: list[str],
    *,
    height: float | None = None,
    switches: bool = True,
) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per label, stacked over the axis of time, each of some height [in].

    A dashed vertical line marks every switch to the next cell, and the caption says so, unless ``switches``
    is false.
    """
    count = len(labels)
    height = height or (_SINGLE if count == 1 else _SEVERAL)
    if switches:
        caption = f"{caption} Dashed lines mark the switches from cell to cell."
    figure = Figure(figsize=(_WIDTH, count * (height + _GAP) + 1.0))
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    canvas.set_margins(figure, caption, _MARGINS)
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
    return figure, axes


def break_at_switches(log: SimulationLog, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a line that is broken at every switch, so that a jump is not drawn as a slope.

    Times [s] and values, shape (T,), get one more entry at every switch: a NaN before the new cell's first
    value.
    """
    places = np.flatnonzero(np.diff(log.cell_index)) + 1
    return np.insert(log.times, places, log.times[places]), np.insert(values.astype(float), places, np.nan)


# Figures of a run over time: the paper's Figures 6 to 13, and a summary of clearances, speeds and forces.


def position_figure(log: SimulationLog) -> Figure:
    """Draw the object's position and that of the reference governor, or of the motion, over time."""
    name, leads = (
        ("motion", "motion that it follows")
        if log.phases.size
        else ("governor", "reference governor that leads it")
    )
    figure, axes = time_axes(
        log, f"Figure 6. Position of the object, and of the {leads}.", ["x [m]", "y [m]"]
    )
    for axis, ax in enumerate(axes):
        ax.plot(log.times, log.governor_position[:, axis], color=GREY, linewidth=0.9, label=name)
        ax.plot(log.times, log.object_pose[:, axis], color=OBJECT, label="object")
    canvas.legend_above(axes[0])
    return figure


def angle_figure(log: SimulationLog) -> Figure:
    """Draw the object's angle inside its bounds over time, and both measured from their middle."""
    caption = f"Figure 7. Angle of the object in its {_kept_in(log)}; below, both measured from the middle."
    labels = ["θ [rad]", "θ, from the middle [rad]"]
    figure, axes = time_axes(log, caption, labels, height=2.3)
    middle = 0.5 * (log.funnel_lower[:, 0] + log.funnel_upper[:, 0])
    for ax, origin in zip(axes, (np.zeros_like(middle), middle), strict=True):
        _draw_bounds(ax, log, 0, origin)
        ax.plot(*break_at_switches(log, log.object_pose[:, 2] - origin), color=OBJECT, label="θ")
    canvas.legend_above(axes[0])
    return figure


def joints_figure(tree: ComponentTree, log: SimulationLog, robot: int) -> Figure | None:
    """Draw the joints of one robot inside their bounds over time; None for a robot without joints."""
    joints = [joint for joint in tree.joints if joint.robot == robot]
    if not joints:
        return None
    name = log.robot_names[robot]
    caption = f"Figure {min(10 + robot, 11)}. Joints of {name} between the bounds of their {_kept_in(log)}s."
    labels = [f"{joint.name.split('::')[-1]} [{joint.unit}]" for joint in joints]
    figure, axes = time_axes(log, caption, labels)
    for joint, ax in zip(joints, axes, strict=True):
        _draw_bounds(ax, log, 1 + joint.index, np.zeros_like(log.times))
        ax.plot(log.times, log.joints[:, joint.index], color=robot_colour(robot), label="joint")
    canvas.legend_above(axes[0])
    return figure


class _Curve(NamedTuple):
    """A curve of the summary beside a limit.

    Attributes:
        label: What it shows.
        of: Whose limit it is.
        colour: Of the curve and of the limit.
        times: Shape (T,) [s].
        values: Shape (T,).
        limit: Infinity where none is known.
    """

    label: str
    of: str
    colour: str
    times: FloatArray
    values: FloatArray
    limit: float = inf


_FAR = 6.0
"""A limit that is larger than this times all values is named, not drawn, so that curves stay readable [-]."""

_TITLE: dict[str, Any] = {"loc": "left", "fontsize": 9.0}
"""Place and size [pt] of the words above a panel."""


def summary_figure(problem: PlanningProblem, log: SimulationLog) -> Figure:
    """Draw the speeds, accelerations and forces of a run beside their limits, and its clearances, over time.

    Where the team passes from cell to cell without a stop, usual limits take the place of unknown ones.
    """
    caption = (
        "Summary. Speeds, accelerations and base forces, with their limits (dashed); smallest distances of "
        "the team to walls and between bodies."
    )
    labels = ["speed [m/s]", "acceleration [m/s²]", "base force [N]", "clearance [m]"]
    figure, (speeds, accelerations, forces, clearances) = time_axes(
        log, caption, labels, height=1.5, switches=False
    )
    ends, means = base_speeds(log)
    of_object = partial(_Curve, "object", "the object", OBJECT, log.times)
    of_bases = partial(_of_bases, log.robot_names)
    limits, stops = _limits_in(problem, log), steadiness(log)[0]
    of_speed = [
        *of_bases("fastest base", ends, means[..., 0], limits[0]),
        of_object(np.hypot(*log.object_twist.T[:2])),
    ]
    of_acceleration = [
        *of_bases("most accelerated base", log.times, _base_accelerations(problem, log), limits[1]),
        of_object(np.hypot(*log.accelerations.T[:2]), limits[3]),
    ]
    base_forces = np.hypot(*np.moveaxis(log.base_wrenches[..., :2], -1, 0))
    _draw_beside_limits(speeds, of_speed, f", near stops on the way: {stops or 'none'}")
    _draw_beside_limits(accelerations, of_acceleration)
    _draw_beside_limits(forces, of_bases("base with the largest force", log.times, base_forces, limits[2]))
    for values, colour, label in (
        (log.workspace_clearance, BLUE, "team to walls"),
        (log.body_clearance, GREEN, "between bodies"),
    ):
        clearances.plot(log.times, values, color=colour, linewidth=1.0, label=label)
    nearest = min(log.workspace_clearance.min(), log.body_clearance.min())
    clearances.set_title(f"at least {nearest:.3f} m", **_TITLE)
    clearances.set_ylim(bottom=min(0.0, nearest))
    canvas.legend_above(clearances)
    return figure


def _limits_in(
    problem: PlanningProblem, log: SimulationLog
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return the limits of a run's bases, of speed, acceleration and force, and the object's of acceleration.

    Those of the bases have the shape (N,), infinity for none [m/s, m/s^2, N, m/s^2].
    """
    of, robots = problem.limits, len(log.robot_names)
    forces = of.base_forces
    if log.phases.size:
        of, forces = of.with_defaults(), largest_forces(of)
    speeds, accelerations, of_object = of.base_speeds, of.base_accelerations, of.object_acceleration
    unknown = np.full(robots, inf)
    speeds, accelerations, forces = (
        each if each.size else unknown for each in (speeds, accelerations, forces)
    )
    return speeds, accelerations, forces, float(of_object.min(initial=inf))


def _base_accelerations(problem: PlanningProblem, log: SimulationLog) -> FloatArray:
    """Return the magnitude of the acceleration of the bases' origins by that of object and joints [m/s^2].

    Its shape is (T, N), or (T, 0) where it is not known at which component bases are.
    """
    z, rates = np.hstack([log.object_pose, log.joints]), np.hstack([log.object_twist, log.joint_rates])
    bases = zip(problem.limits.base_components, problem.limits.base_points, strict=True)
    found = [
        np.hypot(
            *moved(np.array(point), component_stages(problem.tree, on), z, rates, log.accelerations)[2].T
        )
        for on, point in bases
    ]
    return np.array(found).reshape(-1, len(z)).T


def _of_bases(
    names: Sequence[str], of_all: str, times: FloatArray, values: FloatArray, limits: FloatArray
) -> list[_Curve]:
    """Return a curve for every limit that bases have, of the largest value of those that have it.

    Values have the shape (T, N), limits (N,); where all are equal, the curve's label is ``of_all``.
    """
    found, known = [], [_short(limit) for limit in limits]
    for shared in dict.fromkeys(known[: values.shape[1]]):
        rows = [k for k, limit in enumerate(known) if limit == shared]
        label, of, colour = of_all, "bases", INK
        if len(rows) < len(known):  # A limit that is drawn names its curve by the colour.
            of, colour = ", ".join(names[k] for k in rows), robot_colour(rows[0])
            label = of if shared == "inf" else ""
        largest = values[:, rows].max(axis=1, initial=0.0)
        found.append(_Curve(label, of, colour, times, largest, float(limits[rows].min())))
    return found


def _short(limit: float) -> str:
    """Return a limit with three digits, and without an exponent below a million."""
    return f"{float(f'{limit:.3g}'):g}"


def _draw_beside_limits(ax: Axes, curves: Sequence[_Curve], remark: str = "") -> None:
    """Draw curves with their limits, and say above them how near to these they come."""
    largest = max((float(curve.values.max(initial=0.0)) for curve in curves), default=0.0)
    near = [curve.limit for curve in curves if curve.limit <= _FAR * largest]
    top = 1.25 * max([largest, *near]) or 1.0
    ax.set_ylim(0.0, top)
    unit = ax.get_ylabel().partition("[")[2].rstrip("]")
    for curve in curves:
        ax.plot(curve.times, curve.values, color=curve.colour, linewidth=1.0, label=curve.label)
    limited = [curve for curve in curves if curve.limit < inf]
    for number, curve in enumerate(limited):
        ax.axhline(curve.limit, color=curve.colour, linewidth=0.9, linestyle=(0, (5, 3)))
        above = curve.limit > top
        ax.annotate(
            f"{'↑ ' if above else ''}limit of {curve.of}: {_short(curve.limit)} {unit}",
            (0.995 - 0.3 * (number % 3), min(curve.limit, 0.88 * top) if above else curve.limit),
            xycoords=ax.get_yaxis_transform(), xytext=(0, 2), textcoords="offset points",
            color=curve.colour, fontsize=8, ha="right",
        )  # fmt: skip
    shares = [float(curve.values.max(initial=0.0)) / curve.limit for curve in limited]
    near_to = f"at most {max(shares):.1%} of a limit" if shares else "no limit is known"
    ax.set_title(near_to + remark, **_TITLE)
    canvas.legend_above(ax)


def curves_figure(log: SimulationLog, caption: str, values: FloatArray, *labels: str) -> Figure:
    """Draw one curve of the object over time in every panel; values of shape (T, panels)."""
    figure, axes = time_axes(log, caption, list(labels))
    for ax, curve in zip(axes, values.T, strict=True):
        ax.plot(log.times, curve, color=OBJECT)
    return figure


def _kept_in(log: SimulationLog) -> str:
    """Return what keeps an axis: its funnel, or for a team that passes the interval of its cell."""
    return "interval" if log.phases.size else "funnel"


def _draw_bounds(ax: Axes, log: SimulationLog, axis: int, origin: FloatArray) -> None:
    """Draw both bounds of one axis, measured from an origin that may move, shape (T,)."""
    times, lower = break_at_switches(log, log.funnel_lower[:, axis] - origin)
    _, upper = break_at_switches(log, log.funnel_upper[:, axis] - origin)
    ax.fill_between(times, lower, upper, color=SKY, alpha=0.25, linewidth=0, label=_kept_in(log))
    for bound in (lower, upper):
        ax.plot(times, bound, color=INK, linewidth=0.7)


# Every figure of a run, written into one directory.


def write_figures(
    problem: PlanningProblem,
    plan: Plan,
    log: SimulationLog,
    directory: Path,
    *,
    numbers: Iterable[int] | None = None,
) -> list[Path]:
    """Write figures 4 to 13 of the paper and a summary of the margins as PNG; return the files written.

    Figures 10 and 11 show one robot each; those of further robots are called Figure 11, too. Where several
    processes write them, each gets the ``numbers`` of those that it shall write, see `figures_of`.
    """
    written, known = [], figures_of(problem, plan, log)
    with canvas.house_style():
        for name, draw in known if numbers is None else (known[number] for number in numbers):
            figure = draw()
            if figure is not None:
                written.append(write_atomically(directory / f"{name}.png", canvas.picture_of(figure)))
    return written


def figures_of(
    problem: PlanningProblem, plan: Plan, log: SimulationLog
) -> list[tuple[str, Callable[[], Figure | None]]]:
    """Name every figure of a run, with what draws it; a robot without joints has none of them."""
    workspace, tree = problem.workspace, problem.tree
    curves, twist, wrench = partial(curves_figure, log), log.object_twist, log.object_wrench
    velocity, turning = (
        "Figure 8. Linear velocity of the object.",
        "Figure 9. Angular velocity of the object.",
    )
    force = "Figure 12. Total force that the robots apply to the object."
    torque = "Figure 13. Total torque that the robots apply to the object, about its centre of mass."
    return [
        ("fig04_start_and_goal", partial(start_and_goal_figure, workspace, tree, plan)),
        ("fig05_path", partial(path_figure, workspace, tree, log)),
        ("fig06_position", partial(position_figure, log)),
        ("fig07_angle", partial(angle_figure, log)),
        ("fig08_velocity", partial(curves, velocity, twist[:, :2], "x velocity [m/s]", "y velocity [m/s]")),
        ("fig09_angular_velocity", partial(curves, turning, twist[:, 2:], "angular velocity [rad/s]")),
        *(
            (joints_figure_name(robot, name), partial(joints_figure, tree, log, robot))
            for robot, name in enumerate(log.robot_names)
        ),
        ("fig12_force", partial(curves, force, wrench[:, :2], "x force [N]", "y force [N]")),
        ("fig13_torque", partial(curves, torque, wrench[:, 2:], "torque [N m]")),
        ("summary", partial(summary_figure, problem, log)),
    ]
