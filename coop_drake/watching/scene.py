"""The scene: the channel that the search follows, over the floor and theta, keyframe by keyframe."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import CrossSection
from meshcat.animation import Animation

from coop_drake.drawing import colours
from coop_drake.drawing.solids import TriangleMesh, extruded_section, joined, tube_mesh
from coop_drake.files import write_atomically
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.cells.graph import Kind
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.channel_path import PathPiece
from coop_drake.watching.keyframes import Keyframe
from coop_drake.watching.offline_page import offline_visualizer
from coop_drake.watching.projections import union
from coop_drake.watching.recording import SearchRecording
from coop_drake.watching.scene_coordinates import SceneCoordinates
from coop_drake.watching.scene_surroundings import Surface, put_mesh, put_surroundings, scene_labels
from coop_drake.watching.theta_layers import THETA, layers, on_turn

_RATE = 4
"""Keyframes per second [1/s]: each can be looked at."""

_GAP = 0.06
"""Fraction of a slab's height that is left open, so that layers can be told apart."""

_OUTLINE_TOLERANCE = 0.004
"""Distance by which outlines may move when they are simplified, relative to the floor's larger side."""

_LINE = 0.06
"""Radius of the line through the channel [units]."""

_CELLS = 0.35
"""Opacity of cells, through which others and the line are to be seen."""

_CHANNEL = (
    (True, colours.PROVED_FREE, colours.CHANNEL),
    (False, colours.UNDECIDED, colours.UNDECIDED_CHANNEL),
)
"""Colours of cells that are proved free and of undecided ones, and of the line through them."""

_KEY = (
    (colours.PROVED_FREE, "cell of the channel, proved free"),
    (colours.UNDECIDED, "cell of the channel, undecided"),
    (colours.CHANNEL, "path through cells that are proved free; frame: halved now"),
    (colours.UNDECIDED_CHANNEL, "path through undecided cells"),
)
_COMPONENTS_KEY = (
    (colours.REACHED, "at the end: may be reached from the start"),
    (colours.UNREACHED, "at the end: cannot be reached"),
)
_NOTE = (
    "The floor lies below, the object's angle θ points upwards: each cell of the channel that the search "
    "follows is as high as its interval of θ. Joints have no direction here."
)


def write_scene(
    recording: SearchRecording, frames: Sequence[Keyframe], path: Path, progress: Progress | None = None
) -> Path:
    """Write the scene as one self-contained HTML page; an interrupted write leaves no file behind."""
    return write_atomically(path, scene_page(recording, frames, progress).encode())


def scene_page(
    recording: SearchRecording, frames: Sequence[Keyframe], progress: Progress | None = None
) -> str:
    """Return the page: the channel in space, with play, pause and a slider over the keyframes."""
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
    for number, (_, group) in enumerate(groupby(range(len(frames)), key=lambda k: id(frames[k].path))):
        if progress is not None:
            progress("channel", number / len(frames))
        during = list(group)
        _put_channel(vis, frames[during[0]], (during[0], during[-1]), scene, shown)
    _put_halved_layers(vis, frames, scene, shown)
    _put_components(vis, frames, scene, shown)
    vis.set_animation(shown.animation)
    page: str = vis.static_html()
    return page


class _Shown:
    """The animation: which objects are visible during which keyframes."""

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


def _put_channel(
    vis: Any, frame: Keyframe, during: tuple[int, int], scene: SceneCoordinates, shown: _Shown
) -> None:
    """Put up the cells of a channel and the path through it, proved and undecided ones apart."""
    for proved, fill, line in _CHANNEL:
        name = "proved" if proved else "undecided"
        cells = [cell for cell in frame.state.channel if (cell.kind is Kind.FREE) == proved]
        slabs = [(theta, cell.region.section) for cell in cells for theta in on_turn(cell.intervals[0])]
        _put(vis, f"cells/{name}", during, _slabs(slabs, scene), Surface(fill, _CELLS), shown)
        pieces = [piece for piece in frame.path if (piece.kind is Kind.FREE) == proved]
        tubes = joined(tube_mesh(_line(piece, scene), _LINE) for piece in pieces)
        _put(vis, f"path/{name}", during, tubes, Surface(line, lit=False, hidden=False), shown)


def _put(
    vis: Any, path: str, during: tuple[int, int], mesh: TriangleMesh, surface: Surface, shown: _Shown
) -> None:
    """Put up a mesh that is shown from the first to the last of some keyframes, unless it is empty."""
    if len(mesh.faces):
        own = vis[f"{path}/{during[0] + 1:03d}-{during[1] + 1:03d}"]
        put_mesh(own, mesh, surface)
        shown.during(own, *during)


def _slabs(slabs: Iterable[tuple[Interval, CrossSection]], scene: SceneCoordinates) -> TriangleMesh:
    """Return positions over intervals of theta as one mesh."""
    tolerance = _OUTLINE_TOLERANCE * scene.extent
    mesh = joined(
        extruded_section(section, *scene.heights(theta, _GAP), tolerance)
        for theta, section in slabs
        if not section.is_empty()
    )
    return TriangleMesh(scene.vertices(mesh.vertices), mesh.faces)


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
        lines = joined(tube_mesh(line, 0.25 * _LINE) for line in (*rings, *posts))
        _put(vis, "halved", (number, number), lines, Surface(colours.HALVED), shown)


def _put_components(vis: Any, frames: Sequence[Keyframe], scene: SceneCoordinates, shown: _Shown) -> None:
    """Put up what start and goal lie in where they are proved to be apart, united over the joints."""
    for number, frame in enumerate(frames):
        if frame.components is None:
            continue
        for name, cells, colour in (
            ("reached", frame.components.reached, colours.REACHED),
            ("others", frame.components.others, colours.UNREACHED),
        ):
            found = layers((leaf.intervals[0], region) for leaf, region in cells)
            slabs = _slabs(((theta, union(regions)) for theta, regions in found), scene)
            _put(vis, name, (number, number), slabs, Surface(colour, 0.5), shown)
