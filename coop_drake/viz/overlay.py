"""What recordings and live views show beside the scene: headline, verdict, time, cell, key, and a player."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.geometry import Rgba
from shapely import Polygon, box

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.speeds import base_speeds
from coop_drake.drawing.colours import GREY
from coop_drake.drawing.player import player_style
from coop_drake.errors import CoopDrakeError
from coop_drake.scenario import Scenario
from coop_drake.templates import rendered
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.arrows import LONGEST
from coop_drake.viz.cells import CELL_COLOUR, GOAL_COLOUR, GOAL_POSE_COLOUR
from coop_drake.viz.paint import hex_colour
from coop_drake.viz.stage import FILL, floor_corners
from coop_drake.viz.trail import TRAIL_COLOUR

_RATE = 10.0
"""Clearances and speeds shown per second [1/s]: digits that change faster cannot be read."""


def page_content(
    scenario: Scenario,
    plan: Plan,
    log: SimulationLog,
    *,
    duration: float,
    colours: list[Rgba],
    of_a_metre: float,
) -> dict[str, Any]:
    """Return what a recording's script shows, as JSON has it.

    ``duration`` is that of the animation [s], ``colours`` are the robots', and an arrow of a metre stands for
    ``of_a_metre`` [N].
    """
    times = np.arange(0.0, duration + 0.5 / _RATE, 1.0 / _RATE)
    rows = np.maximum(np.searchsorted(log.times, times, side="right") - 1, 0)
    first = np.flatnonzero(np.diff(log.cell_index, prepend=-1))
    robots = dict(zip(log.robot_names, colours, strict=True))
    return {
        **scene_content(scenario, robots, of_a_metre),
        "duration": duration,
        "switches": log.times[first].round(3).tolist(),
        "cells": log.cell_index[first].tolist(),
        "of_cells": len(plan.cells),
        "rate": _RATE,
        "clearance": log.workspace_clearance[rows].round(3).tolist(),
        "speed": np.hypot(*log.object_twist[rows, :2].T).round(3).tolist(),
        "base_speed": np.interp(times, *_fastest_base(log)).round(3).tolist(),
        "reached": log.reached and not log.violation,
        "verdict": verdict_of(log),
    }


def scene_content(scenario: Scenario, robots: Mapping[str, Rgba], of_a_metre: float) -> dict[str, Any]:
    """Return what the script of every page needs, as JSON has it: headline, key, and how to fit the floor.

    ``robots`` are the robots' names and colours; an arrow of a metre stands for ``of_a_metre`` [N].
    """
    return {
        "headline": f"{scenario.name}: {len(robots)} robots carry one object",
        "corners": floor_corners(scenario.workspace.polygon, scenario.visualization.wall_height),
        "fill": FILL,
        "side": _emptier_side(scenario.workspace.polygon),
        "key": [
            ("area", CELL_COLOUR, "cell: the object's centre stays in here"),
            ("area", GOAL_COLOUR, "goal region: from here the next cell is entered"),
            ("area", GOAL_POSE_COLOUR, "goal: the frame that the object fits into"),
            ("line", TRAIL_COLOUR, "trail of the object's centre"),
            *(
                ("arrow", hex_colour(colour), f"force of {robot} on the object, {of_a_metre:g} N a metre")
                for robot, colour in robots.items()
            ),
            ("dot", GREY, f"grasps, in their robots' colours; arrows end at {LONGEST:g} m"),
        ],
    }


def verdict_of(log: SimulationLog) -> str:
    """Return in a sentence how the run ended, and how near anything came to a wall or to another body."""
    if log.violation:
        end = log.violation
    elif log.reached:
        end = f"arrived after {log.times[-1]:.1f} s"
    else:
        end = f"the goal was not reached within {log.times[-1]:.1f} s"
    return (
        f"{end}; smallest clearance {log.workspace_clearance.min():.3f} m to walls, "
        f"{log.body_clearance.min():.3f} m between bodies"
    )


def _fastest_base(log: SimulationLog) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and the speed of the fastest base then [m/s]."""
    times, speeds = base_speeds(log)
    return (times, speeds[..., 0].max(axis=1)) if len(times) else (np.zeros(1), np.zeros(1))


def with_overlay(page: str, content: dict[str, Any], template: str = "overlay.html") -> str:
    """Add headline, key and what else a template has, by default a player, to a page of Drake's Meshcat.

    Raises:
        CoopDrakeError: The page is not built as Drake builds it.
    """
    overlay = rendered("coop_drake.viz", template, content=content, style=player_style())
    body, end, rest = page.rpartition("</body>")
    if not end or not re.search(r"\bvar viewer = new MeshCat\.Viewer\b", body):
        raise CoopDrakeError("this version of Drake writes recordings in a way that coop_drake does not know")
    return f"{body}{overlay}{end}{rest}"


def _emptier_side(floor: Polygon) -> str:
    """Return the lower corner of the page, left or right, in which the key hides less of the floor."""
    x_min, y_min, x_max, y_max = floor.bounds
    across, up = 0.35 * (x_max - x_min), y_min + 0.3 * (y_max - y_min)
    hidden = {
        "left": floor.intersection(box(x_min, y_min, x_min + across, up)).area,
        "right": floor.intersection(box(x_max - across, y_min, x_max, up)).area,
    }
    return min(hidden, key=lambda side: hidden[side])
