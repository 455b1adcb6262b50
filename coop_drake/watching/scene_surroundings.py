"""What the scene shows at every keyframe: floor, walls, start, goal and the scale of theta."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any
from uuid import NAMESPACE_OID, uuid5

import numpy as np
from meshcat.geometry import Mesh, MeshBasicMaterial, MeshPhongMaterial, TriangularMeshGeometry
from shapely import Polygon

from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.drawing.colours import FLOOR_IN_SPACE, INK, WALL
from coop_drake.drawing.footprints import team_footprints
from coop_drake.drawing.solids import TriangleMesh, joined, slab_mesh, tube_mesh, wall_polygons
from coop_drake.geometry.parts import parts_of
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.scene_coordinates import SceneCoordinates
from coop_drake.watching.theta_layers import THETA, on_turn

_TICKS = ((0.0, "θ = 0"), (pi / 2, "π/2"), (pi, "π"), (3 * pi / 2, "3π/2"))
"""Marks on the scale of theta: angle [rad] and text."""

_DIGITS = 3
"""Decimals of vertices in units, of which the scene has ten: finer than a screen."""

_POLE = 0.04
"""Radius of the poles that show the angle at start and goal [units]."""

_WALL_THICKNESS = 0.012
"""Thickness of walls, relative to the floor's larger side."""

_LIGHTS = {"AmbientLight": 0.75, "FillLight": 0.35, "PointLightNegativeX": 0.15, "PointLightPositiveX": 0.25}
"""Intensities of Meshcat's lights: enough from one side that layers can be told apart."""


@dataclass(frozen=True)
class Surface:
    """How a mesh is drawn.

    Attributes:
        colour: ``#rrggbb``.
        opacity: 1 hides what is behind, less lets it show.
        lit: Whether it is lighter where light falls on it.
        hidden: Whether what is before it hides it.
    """

    colour: str
    opacity: float = 1.0
    lit: bool = True
    hidden: bool = True


def put_mesh(vis: Any, mesh: TriangleMesh, surface: Surface) -> None:
    """Put a mesh, its vertices in units, at a path of the scene.

    Its identifiers follow from the path, so that pages repeat.
    """
    transparent = surface.opacity < 1.0 or not surface.hidden
    options: dict[str, Any] = {"transparent": transparent, "depthWrite": not transparent}
    if surface.lit:
        options.update(flatShading=True, shininess=5.0)
    material = (MeshPhongMaterial if surface.lit else MeshBasicMaterial)(
        color=int(surface.colour[1:], 16), opacity=surface.opacity, depthTest=surface.hidden, **options
    )
    body = Mesh(TriangularMeshGeometry(np.round(mesh.vertices, _DIGITS), mesh.faces), material)
    for role, part in (("geometry", body.geometry), ("material", material), ("object", body)):
        part.uuid = str(uuid5(NAMESPACE_OID, f"{vis.path.lower()}/{role}"))
    vis.set_object(body)


def put_surroundings(vis: Any, problem: PlanningProblem, scene: SceneCoordinates) -> None:
    """Put up light, floor, walls, the scale of theta, and start and goal with their poles."""
    for name in ("top_color", "bottom_color"):
        vis["/Background"].set_property(name, [1.0, 1.0, 1.0])
    for path in ("/Grid", "/Axes"):
        vis[path].set_property("visible", False)
    for name, intensity in _LIGHTS.items():
        vis[f"/Lights/{name}/<object>"].set_property("intensity", intensity)
    walls = wall_polygons(problem.workspace, _WALL_THICKNESS * scene.extent)
    _put_slab(vis["floor"], [problem.workspace], (-0.02, 0.0), Surface(FLOOR_IN_SPACE), scene)
    _put_slab(vis["walls"], walls, (-0.02, 0.25), Surface(WALL), scene)
    x, y = scene.corner
    lines = [np.array([[x, y, scene.height(theta)] for theta in THETA])]
    lines += [np.array([[x, y, scene.height(t)], [x + 0.2, y, scene.height(t)]]) for t, _ in _TICKS]
    put_mesh(vis["theta"], joined(tube_mesh(line, 0.5 * _POLE) for line in lines), Surface(INK))
    for name, z in _ends(problem).items():
        shapes = [part for foot in team_footprints(problem.tree, z) for part in parts_of(foot.shape)]
        _put_slab(vis[f"{name}/footprint"], shapes, (0.01, 0.05), Surface(INK, 0.55), scene)
        top = _point(scene, z)
        pole = tube_mesh(np.array([[*top[:2], 0.0], top]), 0.5 * _POLE)
        cap = tube_mesh(np.array([top, top + np.array([0.0, 0.0, 0.05])]), 3.0 * _POLE)
        put_mesh(vis[f"{name}/pole"], joined([pole, cap]), Surface(INK))


def scene_labels(problem: PlanningProblem, scene: SceneCoordinates) -> list[dict[str, Any]]:
    """Return the texts of the scene and where they stand, for the page."""
    labels: list[dict[str, Any]] = [
        {"text": text, "at": [*scene.corner.tolist(), float(scene.height(theta))], "small": True}
        for theta, text in _TICKS
    ]
    for name, z in _ends(problem).items():
        at = _point(scene, z) + np.array([0.0, 0.0, 0.35])
        labels.append({"text": name, "at": at.tolist(), "small": False})
    return labels


def _ends(problem: PlanningProblem) -> dict[str, FloatArray]:
    """Return z = (x, y, theta, q...) at both ends, free joints of the goal as they start, shape (3 + n,)."""
    goal = at_goal(problem.goal_pose, problem.goal_joints, problem.start[3:])
    return {"start": problem.start, "goal": goal}


def _point(scene: SceneCoordinates, z: FloatArray) -> FloatArray:
    """Return the point (x, y, theta) of the object, shape (3,) [units]."""
    (theta, _), *_ = on_turn((float(z[2]) - 1e-6, float(z[2]) + 1e-6))
    point: FloatArray = scene.points(z[None, :2], np.array([theta]))[0]
    return point


def _put_slab(
    vis: Any,
    shapes: Sequence[Polygon],
    heights: tuple[float, float],
    surface: Surface,
    scene: SceneCoordinates,
) -> None:
    """Put up shapes [m] between two heights [units]."""
    mesh = slab_mesh(shapes, *heights)
    put_mesh(vis, TriangleMesh(scene.vertices(mesh.vertices), mesh.faces), surface)
