"""The scene: cells of (x, y, theta) over the floor, stacked by angle, and the way through them, as one page.

It shows the last channel that a search has found, or the two components that hold start and goal where they
are proved to be apart. Meshcat's viewer stands in the page, which needs no server and no network.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Sequence
from html import escape
from math import pi, radians
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_OID, uuid5

import meshcat
import numpy as np
from manifold3d import CrossSection
from meshcat.geometry import Mesh, MeshPhongMaterial, TriangularMeshGeometry
from meshcat.visualizer import ViewerWindow, Visualizer
from shapely import Polygon
from shapely.affinity import affine_transform

from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.drawing import colours
from coop_drake.drawing.solids import (
    TriangleMesh,
    camera_pose,
    extruded_section,
    joined,
    slab_mesh,
    team_footprints,
    tube_mesh,
    wall_polygons,
)
from coop_drake.files import write_atomically
from coop_drake.geometry.polygons import parts_of
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.cells.graph import Kind
from coop_drake.tree.arrays import FloatArray
from coop_drake.watching.keyframes import THETA, Keyframe, PathPiece, layers, on_turn, union
from coop_drake.watching.recording import SearchRecording

_EXTENT, _BOTTOM, _TOP = 10.0, 0.5, 6.5
"""Larger side of the floor, and heights at which the turn of theta begins and ends [units]."""

_GAP = 0.06
"""Fraction of a cell's height that is left open, so that cells can be told apart [-]."""

_LINE, _POLE = 0.06, 0.03
"""Radii of the way, and of marks and poles [units]."""

_OUTLINE_TOLERANCE = 0.004
"""Distance by which outlines may move when they are simplified, relative to the floor's larger side [-]."""

_WALL_THICKNESS = 0.012
"""Thickness of walls, relative to the floor's larger side [-]."""

_TICKS = (0.0, pi / 2, pi, 3 * pi / 2)
"""Marks on the scale of theta [rad]."""

_KEY = (
    (colours.PROVED_FREE, "cell of the channel, proved free"),
    (colours.UNDECIDED, "cell of the channel, undecided"),
    (colours.CHANNEL, "way through cells that are proved free"),
    (colours.UNDECIDED_CHANNEL, "way through undecided cells"),
    (colours.REACHED, "may be reached from the start"),
    (colours.UNREACHED, "cannot be reached"),
)
_NOTE = (
    "The floor lies below, the object's angle θ points upwards, with marks at 0, π/2, π and 3π/2: each cell "
    "is as high as its interval of θ. Joints have no direction here. Poles stand at start and goal."
)
_VIEWER = Path(meshcat.__file__).parent / "viewer" / "dist" / "main.min.js"
_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Watching the planner search</title><link rel="icon" href="data:,">
<style>body {{ margin: 0; font: 14px system-ui, sans-serif; }} #pane {{ height: 100vh; }}
#key {{ position: absolute; left: 18px; top: 14px; width: 340px; background: #fffc; padding: 8px; }}
#key i {{ display: inline-block; width: 12px; height: 12px; margin-right: 8px; }}</style></head>
<body><div id="pane"></div><div id="key"><b>{headline}</b><p>{counters}</p>{key}<p>{note}</p></div>
<script>{viewer}</script>
<script>
const viewer = new MeshCat.Viewer(document.getElementById("pane"));
const upright = ([x, y, z]) => [x, z, -y];  // Meshcat's scene has z up, its camera y up.
viewer.controls.target.set(...upright({target}));
viewer.camera.position.set(...upright({position}));
viewer.controls.update();
async function show() {{
  const packed = Uint8Array.from(atob("{commands}"), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(plain).arrayBuffer());
  let from = 0;
  for (const length of {lengths}) viewer.handle_command_bytearray(bytes.slice(from, from += length));
}}
show();
</script></body></html>
"""


def write_scene(recording: SearchRecording, frames: Sequence[Keyframe], path: Path) -> Path:
    """Write the scene as one self-contained HTML page; an interrupted write leaves no file behind."""
    return write_atomically(path, scene_page(recording, frames).encode())


def scene_page(recording: SearchRecording, frames: Sequence[Keyframe]) -> str:
    """Return the page with what the last keyframe shows, or the last one that has a channel."""
    apart = frames[-1].components is not None
    shown = next((one for one in reversed(frames) if apart or one.state.channel), frames[-1])
    scene, kept = _Scene(recording.problem.workspace), _Messages()
    vis: Any = Visualizer(window=_Window(kept))["/think"]
    _put_surroundings(vis, recording.problem, scene)
    if shown.components is not None:
        for name, cells, colour in (
            ("reached", shown.components.reached, colours.REACHED),
            ("others", shown.components.others, colours.UNREACHED),
        ):
            found = layers((leaf.intervals[0], region) for leaf, region in cells)
            _put(vis[name], scene.slabs((theta, union(regions)) for theta, regions in found), colour, 0.5)
    for proved, fill, line in (
        (True, colours.PROVED_FREE, colours.CHANNEL),
        (False, colours.UNDECIDED, colours.UNDECIDED_CHANNEL),
    ):
        name = "proved" if proved else "undecided"
        cells_of = [cell for cell in shown.state.channel if (cell.kind is Kind.FREE) == proved]
        slabs = ((part, cell.region.section) for cell in cells_of for part in on_turn(cell.intervals[0]))
        _put(vis[f"cells/{name}"], scene.slabs(slabs), fill, 0.35)
        pieces = [piece for piece in shown.path if (piece.kind is Kind.FREE) == proved]
        _put(vis[f"way/{name}"], joined(tube_mesh(scene.line(piece), _LINE) for piece in pieces), line)
    return _page(kept.packed, shown, scene)


def _page(commands: Sequence[bytes], shown: Keyframe, scene: _Scene) -> str:
    position, target = scene.camera()
    key = "".join(f'<div><i style="background: {colour}"></i>{text}</div>' for colour, text in _KEY)
    return _PAGE.format(
        headline=escape(shown.headline),
        counters=escape(shown.counters),
        key=key,
        note=_NOTE,
        viewer=_VIEWER.read_text(encoding="utf-8"),
        position=position,
        target=target,
        lengths=json.dumps([len(message) for message in commands]),
        commands=base64.b64encode(gzip.compress(b"".join(commands), mtime=0)).decode(),
    )


class _Messages:
    """Stands in for Meshcat's socket: keeps messages in the order in which they come."""

    def __init__(self) -> None:
        self.packed: list[bytes] = []

    def send_multipart(self, frames: list[bytes]) -> None:
        """Keep a message: its kind, its path, and the packed command that the viewer takes."""
        self.packed.append(frames[2])

    def recv(self) -> bytes:
        """Answer as a server does."""
        return b"ok"


class _Window(ViewerWindow):
    """Takes the place of Meshcat's window, which would start a server process and wait for ports."""

    def __init__(self, messages: _Messages) -> None:
        self.zmq_socket = messages


class _Scene:
    """Turns metres and radians into the scene's units, whatever size the floor has.

    Args:
        floor: The workspace [m].
    """

    def __init__(self, floor: Polygon) -> None:
        x_min, y_min, x_max, y_max = floor.bounds
        self.extent = max(x_max - x_min, y_max - y_min)
        self._scale = _EXTENT / self.extent
        self._middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max)])
        x, y = -self._scale * self._middle
        self._floor = affine_transform(floor, [self._scale, 0.0, 0.0, self._scale, x, y])

    @property
    def corner(self) -> tuple[float, float]:
        """Where the scale of theta stands [units]."""
        x, y = self._floor.bounds[:2]
        return x - 0.03 * _EXTENT, y

    def height(self, theta: float | FloatArray) -> FloatArray:
        """Return the height at which an angle on the turn [rad] is drawn [units]."""
        return _BOTTOM + (_TOP - _BOTTOM) * (np.asarray(theta) - THETA[0]) / (THETA[1] - THETA[0])

    def placed(self, mesh: TriangleMesh) -> TriangleMesh:
        """Return a mesh whose x and y come in metres, and heights in units, in units."""
        plane = (mesh.vertices[:, :2] - self._middle) * self._scale
        return TriangleMesh(np.column_stack([plane, mesh.vertices[:, 2]]), mesh.faces)

    def points(self, positions: FloatArray, theta: FloatArray) -> FloatArray:
        """Return points (x, y, theta), shapes (k, 2) [m] and (k,) [rad], in units, shape (k, 3)."""
        return np.column_stack([(positions - self._middle) * self._scale, self.height(theta)])

    def slabs(self, cells: Iterable[tuple[Interval, CrossSection]]) -> TriangleMesh:
        """Return positions over intervals of theta as one mesh."""

        def ends(theta: Interval) -> tuple[float, float]:
            low, high = (float(self.height(end)) for end in theta)
            inset = 0.5 * _GAP * (high - low)
            return low + inset, high - inset

        tolerance = _OUTLINE_TOLERANCE * self.extent
        filled = ((theta, section) for theta, section in cells if not section.is_empty())
        return self.placed(
            joined(extruded_section(section, *ends(theta), tolerance) for theta, section in filled)
        )

    def line(self, piece: PathPiece) -> FloatArray:
        """Return points along a piece of the way, with NaN where theta passes the end of the turn drawn."""
        theta = THETA[0] + np.mod(piece.angles[:, 0] - THETA[0], 2.0 * pi)
        jumps = np.flatnonzero(np.abs(np.diff(theta)) > pi) + 1
        return np.insert(self.points(piece.positions, theta), jumps, np.nan, axis=0)

    def camera(self) -> tuple[list[float], list[float]]:
        """Return where to stand and where to look so that floor and turn just fill the picture [units]."""
        position, target = camera_pose(
            self._floor, _TOP, elevation=radians(32.0), turn=radians(38.0), fill=0.8
        )
        along = (position - target) / (position - target)[2]  # The scene turns about its middle.
        return position.tolist(), (target + 0.4 * _TOP * along).tolist()


def _put(vis: Any, mesh: TriangleMesh, colour: str, opacity: float = 1.0) -> None:
    """Put a mesh, unless it is empty; its identifiers follow from the path, so that pages repeat."""
    if not len(mesh.faces):
        return
    clear = opacity < 1.0
    options: dict[str, Any] = {"transparent": clear, "depthWrite": not clear, "flatShading": True}
    material = MeshPhongMaterial(color=int(colour[1:], 16), opacity=opacity, **options)
    body = Mesh(TriangularMeshGeometry(np.round(mesh.vertices, 3), mesh.faces), material)
    for role, part in (("geometry", body.geometry), ("material", material), ("object", body)):
        part.uuid = str(uuid5(NAMESPACE_OID, f"{vis.path.lower()}/{role}"))
    vis.set_object(body)


def _put_surroundings(vis: Any, problem: PlanningProblem, scene: _Scene) -> None:
    """Put up floor, walls, the scale of theta, and the team at start and goal with their poles."""
    for name in ("top_color", "bottom_color"):
        vis["/Background"].set_property(name, [1.0, 1.0, 1.0])
    for path in ("/Grid", "/Axes"):
        vis[path].set_property("visible", False)
    walls = wall_polygons(problem.workspace, _WALL_THICKNESS * scene.extent)
    _put(vis["floor"], scene.placed(slab_mesh([problem.workspace], -0.02, 0.0)), colours.FLOOR_IN_SPACE)
    _put(vis["walls"], scene.placed(slab_mesh(walls, -0.02, 0.25)), colours.WALL)
    x, y = scene.corner
    lines = [np.array([[x, y, scene.height(theta)] for theta in THETA])]
    lines += [np.array([[x, y, scene.height(t)], [x + 0.3, y, scene.height(t)]]) for t in _TICKS]
    _put(vis["theta"], joined(tube_mesh(line, _POLE) for line in lines), colours.INK)
    goal = at_goal(problem.goal_pose, problem.goal_joints, problem.start[3:])
    for name, z in {"start": problem.start, "goal": goal}.items():
        shapes = [part for foot in team_footprints(problem.tree, z) for part in parts_of(foot.shape)]
        _put(vis[f"{name}/footprint"], scene.placed(slab_mesh(shapes, 0.01, 0.05)), colours.INK, 0.55)
        (theta, _), *_ = on_turn((float(z[2]) - 1e-6, float(z[2]) + 1e-6))
        (top,) = scene.points(z[None, :2], np.array([theta]))
        pole = tube_mesh(np.array([[*top[:2], 0.0], top]), _POLE)
        cap = tube_mesh(np.array([top, top + np.array([0.0, 0.0, 0.05])]), 4.0 * _POLE)
        _put(vis[f"{name}/pole"], joined([pole, cap]), colours.INK)
