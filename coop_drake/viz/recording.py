"""The recording of a run: one page that any browser opens, without a server."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from shapely import Polygon, box

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.speeds import base_speeds
from coop_drake.drawing.colours import GREY
from coop_drake.drawing.solids import player_style
from coop_drake.errors import CoopDrakeError
from coop_drake.files import write_atomically
from coop_drake.scenario import Scenario
from coop_drake.templates import rendered
from coop_drake.tree.arrays import FloatArray
from coop_drake.viz.scene import (
    ABOVE,
    CELL_COLOUR,
    FILL,
    GOAL_COLOUR,
    GOAL_POSE_COLOUR,
    INDICES,
    LONGEST,
    TRAIL_COLOUR,
    TransportScene,
    arrow_path,
    arrow_sizes,
    cell_paths,
    floor_corners,
    hex_colour,
    set_trail,
    trail_points,
)

# Starts a Meshcat server for this machine, without the line that Drake writes to standard error.


def silent_meshcat() -> Meshcat:
    """Start a Meshcat server that only browsers on this machine reach, and log no address.

    Raises:
        RuntimeError: No port is free.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_is_no_address)
    try:
        return Meshcat(MeshcatParams(host="localhost"))
    finally:
        logger.removeFilter(_is_no_address)


def _is_no_address(record: logging.LogRecord) -> bool:
    return "Meshcat listening for connections" not in record.getMessage()


# What recordings and live views show beside the scene: headline, verdict, time, cell, key, and a player.

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


# Animations of few frames: between those kept, linear interpolation meets all within a tolerance.

_POSITION, _ANGLE, _SCALE = 3e-3, 5e-3, 0.03
"""Largest errors of positions [m], angles [rad] and scales [-]: a pixel or so."""


def kept_frames(values: FloatArray, tolerance: float, *, longest: int) -> list[int]:
    """Return the frames to keep so that linear interpolation between them meets all others.

    Args:
        values: Of every frame, shape (F, k).
        tolerance: Largest error of any component.
        longest: Largest number of frames from one kept frame to the next.
    """
    last = len(values) - 1
    kept = {*range(0, last + 1, longest), last}
    stretches = list(zip(sorted(kept), sorted(kept)[1:], strict=False))
    while stretches:
        first, end = stretches.pop()
        fraction = (np.arange(first + 1, end) - first)[:, None] / (end - first)
        errors = np.abs(values[first] + fraction * (values[end] - values[first]) - values[first + 1 : end])
        if errors.size and errors.max() > tolerance:
            middle = first + 1 + int(errors.max(axis=1).argmax())
            kept.add(middle)
            stretches += [(first, middle), (middle, end)]
    return sorted(kept)


class Tracks:
    """Tracks of an animation; every track lasts from the first to the last frame.

    Args:
        frames_per_second: Of the values that the methods receive [1/s].
    """

    def __init__(self, frames_per_second: float) -> None:
        self.animation = MeshcatAnimation(frames_per_second)
        self._longest = max(1, round(frames_per_second))

    def move(
        self,
        path: str,
        positions: FloatArray,
        angles: FloatArray,
        R_0: RotationMatrix | None = None,
        *,
        angle_tolerance: float = _ANGLE,
    ) -> None:
        """Move and turn an object.

        Args:
            path: The object.
            positions: In the frame of its parent, shape (F, 3) [m].
            angles: About the vertical, unwrapped, shape (F,) [rad].
            R_0: Its orientation at angle zero.
            angle_tolerance: Largest error of the angle [rad].
        """
        R_0 = RotationMatrix() if R_0 is None else R_0
        # A kept frame at least every second: between two of them Meshcat turns the shorter way round.
        weighted = np.column_stack([positions, angles * (_POSITION / angle_tolerance)])
        for frame in kept_frames(weighted, _POSITION, longest=self._longest):
            turn = RotationMatrix.MakeZRotation(angles[frame])
            self.animation.SetTransform(frame, path, RigidTransform(turn @ R_0, positions[frame]))

    def vary(self, path: str, name: str, values: FloatArray) -> None:
        """Change a property of three components, with values of shape (F, 3)."""
        for frame in kept_frames(values, _SCALE, longest=len(values)):
            self.animation.SetProperty(frame, path, name, values[frame].tolist())

    def count(self, path: str, name: str, values: FloatArray) -> None:
        """Change a property that counts, with values of shape (F,), to within one."""
        for frame in kept_frames(values[:, None], 1.0, longest=len(values)):
            self.animation.SetProperty(frame, path, name, float(values[frame]))

    def show(self, path: str, visible: NDArray[np.bool_]) -> None:
        """Show and hide an object; ``visible`` of shape (F,)."""
        changes = np.flatnonzero(np.diff(visible)) + 1
        for frame in sorted({0, *changes.tolist(), len(visible) - 1}):
            self.animation.SetProperty(frame, path, "visible", bool(visible[frame]))


# The log of a run as an animation of bodies, arrows, cells and the object's trail.

_TRAIL = "/motion/trail"
_ARROW_ANGLE = 0.06
"""Largest error of an arrow's direction [rad]: arrows turn fast where forces are small."""


def animation_of(scene: TransportScene, log: SimulationLog, times: FloatArray) -> MeshcatAnimation:
    """Return the tracks of all that moves, appears or grows; the trail is put into the scene.

    ``times`` are those of the frames, evenly spaced, shape (F,) [s].
    """
    tracks = Tracks(1.0 / (times[1] - times[0]) if len(times) > 1 else 1.0)
    states = np.hstack([log.object_pose, log.joints])
    grasps = _add_bodies(tracks, scene, _at_times(log, states, times))
    _add_arrows(tracks, scene, log, times, grasps)
    _add_trail(tracks, scene, _at_times(log, log.object_pose[:, :2], times))
    rows = np.searchsorted(log.times, times, side="right") - 1
    for index in np.unique(log.cell_index):
        for path in cell_paths(int(index)):
            tracks.show(path, log.cell_index[rows] == index)
    return tracks.animation


def _at_times(log: SimulationLog, values: FloatArray, times: FloatArray) -> FloatArray:
    """Return logged values of shape (T, k), interpolated at times of shape (F,): shape (F, k)."""
    return np.column_stack([np.interp(times, log.times, column) for column in values.T])


def _add_bodies(tracks: Tracks, scene: TransportScene, configurations: FloatArray) -> FloatArray:
    """Move every body; return the positions of the grasps, shape (F, N, 3) [m]."""
    poses, grasps = [], []
    for z in configurations:
        poses.append(scene.team.poses(z))
        grasps.append(scene.team.grasp_points(z))
    for body, paths in enumerate(scene.team.paths):
        own = [at_frame[body] for at_frame in poses]
        positions, angles = np.array([X_WB.translation() for X_WB in own]), _turns(own)
        for path in paths:
            tracks.move(path, positions, angles, own[0].rotation())
    return np.array(grasps)


def _turns(poses: list[RigidTransform]) -> FloatArray:
    """Return the angles about the vertical since the first pose, unwrapped, shape (F,) [rad]."""
    R_0 = poses[0].rotation().inverse()
    turns = [(X_WB.rotation() @ R_0).matrix() for X_WB in poses]
    return np.unwrap([np.arctan2(turn[1, 0], turn[0, 0]) for turn in turns])


def _add_arrows(
    tracks: Tracks, scene: TransportScene, log: SimulationLog, times: FloatArray, grasps: FloatArray
) -> None:
    for index in range(len(log.robot_names)):
        forces = _at_times(log, log.measured_wrenches[:, index, :2], times)
        directions, scales = arrow_sizes(forces, scene.of_a_metre)
        path = arrow_path(index)
        tracks.move(path, grasps[:, index] + ABOVE, directions, angle_tolerance=_ARROW_ANGLE)
        tracks.vary(path, "scale", scales)


def _add_trail(tracks: Tracks, scene: TransportScene, positions: NDArray[np.float64]) -> None:
    points, behind = trail_points(positions)
    if len(points) > 1:
        set_trail(scene.meshcat, _TRAIL, points)
        tracks.count(f"{_TRAIL}/<object>", "geometry[drawRange].count", INDICES * behind)


# The recording of a run: a page that any browser opens, without a server.

_MOST_FRAMES = 4000
"""Largest number of frames; longer runs get fewer frames per second, so that the file stays small."""


def write_recording(scenario: Scenario, plan: Plan, log: SimulationLog, path: Path) -> None:
    """Write the run as one self-contained HTML page; an interrupted write leaves no file behind."""
    Recording(scenario, plan).write(log, path)


def recording_html(scenario: Scenario, plan: Plan, log: SimulationLog) -> str:
    """Return a run as a page: the scene, an animation of what was logged, and a player."""
    return Recording(scenario, plan).html(log)


class Recording:
    """The scene of a plan, which becomes a page with the log of one run."""

    def __init__(self, scenario: Scenario, plan: Plan) -> None:
        self._scenario, self._plan = scenario, plan
        self._scene = TransportScene(scenario, plan, silent_meshcat())
        self._scene.place_camera()

    def write(self, log: SimulationLog, path: Path) -> None:
        """Write the page as `write_recording` does."""
        write_atomically(path, self.html(log).encode())

    def html(self, log: SimulationLog) -> str:
        """Return the page as `recording_html` does."""
        scenario, scene, duration = self._scenario, self._scene, float(log.times[-1])
        rate = min(scenario.visualization.frames_per_second, _MOST_FRAMES / max(duration, 1e-9))
        times = np.arange(0.0, duration + 0.5 / rate, 1.0 / rate)
        scene.meshcat.SetAnimation(animation_of(scene, log, times))
        content = page_content(
            scenario,
            self._plan,
            log,
            duration=float(times[-1]),
            colours=scene.team.colours,
            of_a_metre=scene.of_a_metre,
        )
        return with_overlay(scene.meshcat.StaticHtml(), content)


def inline_frame(page: str) -> str:
    """Return HTML that shows a page inside a notebook's cell, 600 pixels tall."""
    escaped = page.replace("&", "&amp;").replace('"', "&quot;")
    frame = f'<iframe srcdoc="{escaped}" width="100%" height="600" style="border: 0"></iframe>'
    return f"<div>{frame}</div>"
