"""The figure of eight errata: results of formulas as printed (orange) and as corrected (blue)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coop_drake.drawing.canvas import house_style, new_figure, save_figure
from coop_drake.drawing.colours import BLUE, GREY, VERMILLION
from coop_drake.laws import energy_margin, total_wrench, tracking_energy, wrench_share
from coop_drake.laws.readiness import EROSION, clearance_margin
from coop_drake.tree.arrays import FloatArray
from paper import printed
from paper.funnel_errata_panels import (
    draw_funnel_bounds,
    draw_hand_over_acceleration,
    draw_log_decay,
    draw_log_term,
)
from paper.governor_run import (
    Clearance,
    GovernorRun,
    Margin,
    box_clearance,
    run_governor,
    straight_field,
)

__all__ = ["errata_figure", "write_errata_figure"]

_TABLE_2 = (50.0, 5.0, 5.0, 0.0)
_TOLERANCE = 1e-7
"""Tolerance of the integration, relative and absolute: enough for a line in a picture."""

_WIDE = box_clearance(np.array([0.0, -1.0]), np.array([4.0, 1.0]))
_NARROW = box_clearance(np.array([2.0, -1.0]), np.array([2.3, 1.0]))


def write_errata_figure(folder: Path) -> Path:
    """Draw the picture into a folder, which is made if it is missing, and return where it is."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "errata.png"
    with house_style():
        save_figure(errata_figure(), path)
    return path


def errata_figure() -> Figure:
    """Draw eight errata: orange as printed, blue as corrected."""
    caption = (
        "Errata. Orange as the paper prints it, blue as corrected. Above, the position: the spring's energy "
        "(E15a), the wall that the goal's boundary would be (E15b), a hand-over to a cell 30 cm wide (E10), "
        "and the torque that two robots give together (E21). Below, an angle in its funnel: bounds (E17a), "
        "the acceleration on entering (E17b), the log term towards a goal (E18), the log that should "
        "decay (E20)."
    )
    figure = new_figure(12.0, 6.4, caption)
    above, below = figure.subplots(2, 4)
    for ax, draw in zip(above, (_draw_wall, _draw_goal, _draw_take_over, _draw_torque), strict=True):
        draw(ax)
    draw_funnel_bounds(below[0])
    draw_hand_over_acceleration(below[1], EROSION)
    draw_log_term(below[2])
    draw_log_decay(below[3])
    above[0].plot([], [], color=VERMILLION, label="as printed")
    above[0].plot([], [], color=BLUE, label="as corrected")
    above[0].legend(loc="upper right")
    return figure


def _from_rest(
    x: float,
    y: float,
    target: FloatArray,
    seconds: float,
    *,
    clearance: Clearance = _WIDE,
    margin: Margin = energy_margin,
) -> GovernorRun:
    """Run from rest at (x, y) to a target with the gains of Table 2."""
    return run_governor(
        clearance,
        straight_field(target),
        position=np.array([x, y]),
        velocity=np.zeros(2),
        governor=np.array([x, y]),
        gains=_TABLE_2,
        seconds=seconds,
        margin=margin,
        tolerance=_TOLERANCE,
    )


def _draw_wall(ax: Axes) -> None:
    """E15a: a target 2 cm before a wall; as printed, the spring may store too much energy."""
    for margin, colour in ((printed.energy_margin, VERMILLION), (energy_margin, BLUE)):
        run = _from_rest(2.0, 0.0, np.array([3.98, 0.0]), 6.0, margin=margin)
        ax.plot(run.times, 100.0 * (4.0 - run.position[:, 0]), color=colour)
    ax.axhline(0.0, color=GREY, linestyle="--")
    ax.set(title="E15a: it crosses the wall", xlabel="time [s]", ylabel="distance to the wall [cm]")
    ax.set_ylim(-12.0, 60.0)


def _draw_goal(ax: Axes) -> None:
    """E15b: the boundary of F contains that of the goal, so that the governor never enters the goal."""
    target, radius = np.array([3.0, 0.0]), 0.3

    def to_boundary_of_f(point: FloatArray) -> float:
        return min(_WIDE(point), abs(float(np.hypot(*(point - target))) - radius))

    for clearance, colour in ((to_boundary_of_f, VERMILLION), (_WIDE, BLUE)):
        run = _from_rest(1.0, 0.2, target, 12.0, clearance=clearance)
        ax.plot(run.times, np.hypot(*(run.position - target).T), color=colour)
    ax.axhline(radius, color=GREY, linestyle="--")
    ax.set(title="E15b: it stops before the goal", xlabel="time [s]", ylabel="distance to the target [m]")


def _draw_take_over(ax: Axes) -> None:
    """E10: a fast object enters a narrow cell; as printed, it leaves the cell again."""
    target = np.array([2.15, 0.0])
    run = _from_rest(0.5, 0.0, target, 12.0)
    inside = next(i for i, p in enumerate(run.position) if _NARROW(p) > 0.0)
    certified = next(i for i in range(len(run.times)) if _certified(run, i))
    for index, colour in ((inside, VERMILLION), (certified, BLUE)):
        after = run_governor(
            _NARROW,
            straight_field(target),
            position=run.position[index],
            velocity=run.velocity[index],
            governor=run.governor[index],
            gains=_TABLE_2,
            seconds=5.0,
            tolerance=_TOLERANCE,
        )
        ax.plot(run.times[index] + after.times, after.position[:, 0], color=colour)
        ax.plot(run.times[index], run.position[index, 0], "o", color=colour, markersize=4)
    for wall in (2.0, 2.3):
        ax.axhline(wall, color=GREY, linestyle="--")
    ax.set(title="E10: it leaves the next cell", xlabel="time [s]", ylabel="x [m], cell dashed")


def _certified(run: GovernorRun, index: int) -> bool:
    stiffness = _TABLE_2[0]
    (x, y), (vx, vy) = run.position[index] - run.governor[index], run.velocity[index]
    energy = tracking_energy(x, y, vx, vy, stiffness)
    margin = energy_margin(energy, _NARROW(run.governor[index]), stiffness)
    return clearance_margin(margin, stiffness, 0.15) >= 0.0


def _draw_torque(ax: Axes) -> None:
    """E21: two grasps on one side share a force of 5 N; the torque that results, where none is commanded."""
    offsets = np.array([[0.4, 0.0], [0.0, 0.25]])
    directions = np.linspace(0.0, 2.0 * np.pi, 73)
    torques = []
    for direction in directions:
        force = 5.0 * np.array([np.cos(direction), np.sin(direction)])
        wrong = [printed.wrench_share(force, 0.0, -offset, robots=2) for offset in offsets]
        right = [wrench_share(-x, -y, force[0], force[1], 0.0, 1.0, 1.0, 0.5) for x, y in offsets]
        torques.append([total_wrench(np.array(s), offsets, np.zeros(2), 0.0)[2] for s in (wrong, right)])
    for torque, colour in zip(np.transpose(torques), (VERMILLION, BLUE), strict=True):
        ax.plot(np.degrees(directions), torque, color=colour)
    ax.set(title="E21: uncommanded torque", xlabel="direction of 5 N [°]", ylabel="torque [N m]")
