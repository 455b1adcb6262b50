"""The scene: what is known about positions and theta over the floor, keyframe by keyframe, in Meshcat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from meshcat.animation import Animation

from coop_drake.drawing import colours
from coop_drake.drawing.solids import TriangleMesh, extruded_section, joined, tube_mesh
from coop_drake.files import write_atomically
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.channel_path import PathPiece
from coop_drake.watching.keyframes import Keyframe
from coop_drake.watching.offline_page import offline_visualizer
from coop_drake.watching.recording import SearchRecording
from coop_drake.watching.scene_coordinates import SceneCoordinates
from coop_drake.watching.scene_surroundings import Surface, put_mesh, put_surroundings, scene_labels
from coop_drake.watching.theta_layers import THETA, Knowledge, Slab, on_turn, slabs_of

__all__ = ["scene_page", "write_scene"]

Progress = Callable[[str, float], None]

_RATE = 4
"""Keyframes per second [1/s]: each can be looked at."""

_GAP = 0.06
"""Fraction of a slab's height that is left open, so that layers can be told apart."""

_OUTLINE_TOLERANCE = 0.004
"""Distance by which outlines may move when they are simplified, relative to the floor's larger side."""

_LINE = 0.06
"""Radius of the line through the channel [units]."""

_SURFACES = {
    Knowledge.FREE: Surface(colours.PROVED_FREE, 0.9),
    Knowledge.UNDECIDED: Surface(colours.UNDECIDED, 0.05, lit=False),
    Knowledge.CHANNEL: Surface(colours.PROVED_FREE, 0.55),
    Knowledge.REACHED: Surface(colours.REACHED, 0.5),
    Knowledge.OTHERS: Surface(colours.UNREACHED, 0.5),
}
_KEY = (
    (colours.PROVED_FREE, "proved free for some choice of the joints"),
    (colours.UNDECIDED, "undecided"),
    (colours.CHANNEL, "channel, proved; frame: halved now"),
    (colours.UNDECIDED_CHANNEL, "channel, undecided"),
)
_COMPONENTS_KEY = (
    (colours.REACHED, "at the end: may be reached from the start"),
    (colours.UNREACHED, "at the end: cannot be reached"),
)
_NOTE = (
    "The floor lies below, the object's angle θ points upwards. Joints have no direction here: "
    "a position is drawn free, or undecided, if any of their values makes it so."
)


def write_scene(
    recording: SearchRecording, frames: Sequence[Keyframe], path: Path, progress: Progress | None = None
) -> Path:
    """Write the scene as one self-contained HTML page; an interrupted write leaves no file behind."""
    return write_atomically(path, scene_page(recording, frames, progress).encode())


def scene_page(
    recording: SearchRecording, frames: Sequence[Keyframe], progress: Progress | None = None
) -> str:
    """Return the page: positions and theta in space, with play, pause and a slider over the keyframes.

    Args:
        recording: The recorded search.
        frames: Its keyframes.
        progress: Called with a text and the fraction done.
    """
    scene = SceneCoordinates(recording.problem.workspace)
    separate = any(frame.components is not None for frame in frames)
    content = {
        "rate": _RATE,
        "keyframes": [{"headline": frame.headline, "counters": frame.counters} for frame in frames],
        "key": [*_KEY, *(_COMPONENTS_KEY if separate else ())],
        "note": _NOTE,
        "labels": scene_labels(recording.problem, scene),
        "camera": scene.camera(),
    }
    vis = offline_visualizer("Watching the planner search", content)["/think"]
    put_surroundings(vis, recording.problem, scene)
    shown = _Shown(len(frames))
    groups = [list(group) for _, group in groupby(sorted(slabs_of(frames), key=_object), key=_object)]
    for number, slabs in enumerate(groups):
        if progress is not None:
            progress("layers", number / len(groups))
        _put_slabs(vis, slabs, scene, shown)
    _put_channels(vis, frames, scene, shown)
    _put_halved_layers(vis, frames, scene, shown)
    vis.set_animation(shown.animation)
    page: str = vis.static_html()
    return page


def _object(slab: Slab) -> tuple[str, int, int]:
    """Return what slabs of one object of the scene have in common."""
    return slab.knowledge.value, slab.first, slab.last


class _Shown:
    """The animation: which objects are visible during which keyframes.

    Args:
        frames: Number of keyframes.
    """

    def __init__(self, frames: int) -> None:
        self.animation = Animation(default_framerate=_RATE)
        self._frames = frames

    def during(self, vis: Any, first: int, last: int) -> None:
        """Show an object from the first to the last of some keyframes only."""
        visible = {0: first == 0, first: True, last + 1: False}
        # Every track lasts as long as the animation: a shorter one would stop before the slider does.
        visible[self._frames] = last == self._frames - 1
        for frame, value in sorted(visible.items()):
            self.animation.at_frame(vis, frame).set_property("visible", "boolean", value)


def _put_slabs(vis: Any, slabs: Sequence[Slab], scene: SceneCoordinates, shown: _Shown) -> None:
    """Put up the slabs that are shown during the same keyframes, as one object."""
    tolerance = _OUTLINE_TOLERANCE * scene.extent
    mesh = joined(
        extruded_section(slab.section, *scene.heights(slab.theta, _GAP), tolerance) for slab in slabs
    )
    knowledge, first, last = _object(slabs[0])
    own = vis[f"{knowledge}/{first + 1:03d}-{last + 1:03d}"]
    put_mesh(own, TriangleMesh(scene.vertices(mesh.vertices), mesh.faces), _SURFACES[slabs[0].knowledge])
    shown.during(own, first, last)


def _put_channels(vis: Any, frames: Sequence[Keyframe], scene: SceneCoordinates, shown: _Shown) -> None:
    """Put up the line through every channel, its proved and its undecided stretches apart."""
    for _, group in groupby(range(len(frames)), key=lambda number: id(frames[number].path)):
        during = list(group)
        for name, proved, colour in (
            ("proved", True, colours.CHANNEL),
            ("undecided", False, colours.UNDECIDED_CHANNEL),
        ):
            pieces = [piece for piece in frames[during[0]].path if (piece.kind is Kind.FREE) == proved]
            mesh = joined(tube_mesh(_line(piece, scene), _LINE) for piece in pieces)
            if len(mesh.faces):
                own = vis[f"channel/{name}/{during[0] + 1:03d}-{during[-1] + 1:03d}"]
                put_mesh(own, mesh, Surface(colour, lit=False, hidden=False))
                shown.during(own, during[0], during[-1])


def _line(piece: PathPiece, scene: SceneCoordinates) -> FloatArray:
    """Return points along a piece of path, with NaN where theta passes the end of the turn drawn."""
    theta = THETA[0] + np.mod(piece.angles[:, 0] - THETA[0], 2.0 * pi)
    points = scene.points(piece.positions, theta)
    jumps = np.flatnonzero(np.abs(np.diff(theta)) > pi) + 1
    return np.insert(points, jumps, np.nan, axis=0)


def _put_halved_layers(vis: Any, frames: Sequence[Keyframe], scene: SceneCoordinates, shown: _Shown) -> None:
    """Put a frame round the layer of theta that was halved last."""
    for number, frame in enumerate(frames):
        if not frame.state.splits or frame.state.verdict is not None:
            continue
        heights = scene.heights(on_turn(frame.state.splits[-1][0].intervals[0])[0], 0.0)
        rings = [np.column_stack([scene.outline, np.full(len(scene.outline), height)]) for height in heights]
        posts = [np.array([[*corner, height] for height in heights]) for corner in scene.outline[:-1]]
        own = vis[f"halved/{number + 1:03d}-{number + 1:03d}"]
        lines = joined(tube_mesh(line, 0.25 * _LINE) for line in (*rings, *posts))
        put_mesh(own, lines, Surface(colours.HALVED))
        shown.during(own, number, number)
