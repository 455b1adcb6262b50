"""What stands in the scene at every moment: floor, walls, start, goal and the scale of theta."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any
from uuid import NAMESPACE_OID, uuid5

import numpy as np
from manifold3d import CrossSection, FillRule
from meshcat.geometry import Mesh, MeshBasicMaterial, MeshPhongMaterial, TriangularMeshGeometry
from shapely import Polygon

from coop_drake.drawing.colours import INK
from coop_drake.drawing.footprints import team_footprints
from coop_drake.drawing.solids import parts_of, wall_polygons
from coop_drake.geometry.minkowski import polygon_rings
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.film import Film
from coop_drake.watching.meshes import Triangles, joined, prism, tube
from coop_drake.watching.space import Space
from coop_drake.watching.stack import THETA, on_turn

__all__ = ["Paint", "place", "put_stage", "stage_labels"]

_TICKS = ((0.0, "θ = 0"), (pi / 2, "π/2"), (pi, "π"), (3 * pi / 2, "3π/2"))
_DIGITS = 3  # Of units of the scene, which is ten across: finer than a screen.
_POLE = 0.004  # Radius of poles as a share of the floor's larger side.
_LIGHTS = {"AmbientLight": 0.75, "FillLight": 0.35, "PointLightNegativeX": 0.15, "PointLightPositiveX": 0.25}
_WALL = "#b9bec4"
_GROUND = "#f2f2ee"


@dataclass(frozen=True)
class Paint:
    """How a mesh looks.

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


def place(vis: Any, mesh: Triangles, paint: Paint) -> None:
    """Put a mesh at a path of the scene; its identifiers follow from the path, so pages repeat.

    Args:
        vis: Meshcat's visualizer at that path.
        mesh: Vertices in units of the scene.
        paint: How it looks.
    """
    colour = int(paint.colour[1:], 16)
    see_through = paint.opacity < 1.0 or not paint.hidden
    look: dict[str, Any] = {
        "transparent": see_through,
        "depthWrite": not see_through,
        "depthTest": paint.hidden,
    }
    if paint.lit:
        look.update(flatShading=True, shininess=5.0)
    made = MeshPhongMaterial if paint.lit else MeshBasicMaterial
    material = made(color=colour, opacity=paint.opacity, **look)
    thing = Mesh(TriangularMeshGeometry(np.round(mesh[0], _DIGITS), mesh[1]), material)
    for role, part in (("geometry", thing.geometry), ("material", material), ("object", thing)):
        part.uuid = str(uuid5(NAMESPACE_OID, f"{vis.path.lower()}/{role}"))
    vis.set_object(thing)


def put_stage(vis: Any, film: Film, space: Space) -> None:
    """Put up light, floor, walls, the scale of theta, and start and goal with their poles."""
    for name in ("top_color", "bottom_color"):
        vis["/Background"].set_property(name, [1.0, 1.0, 1.0])
    for path in ("/Grid", "/Axes"):
        vis[path].set_property("visible", False)
    for name, intensity in _LIGHTS.items():
        vis[f"/Lights/{name}/<object>"].set_property("intensity", intensity)
    floor = film.problem.workspace
    walls = wall_polygons(floor, 0.012 * space.extent)
    _put(vis["floor"], [floor], (-0.02, 0.0), Paint(_GROUND), space)
    _put(vis["walls"], walls, (-0.02, 0.25), Paint(_WALL), space)
    x, y = space.corner()
    scale = np.array([[x, y, float(space.height(theta))] for theta in THETA])
    ticks = [np.array([[x, y, h], [x + 0.2, y, h]]) for h in (float(space.height(t)) for t, _ in _TICKS)]
    radius = _POLE * space.extent * space.scale
    place(vis["theta"], joined([tube(line, 0.5 * radius) for line in (scale, *ticks)]), Paint(INK))
    for name, z in _ends(film).items():
        shapes = [part for foot in team_footprints(film.problem.tree, z) for part in parts_of(foot.shape)]
        _put(vis[f"{name}/footprint"], shapes, (0.01, 0.05), Paint(INK, 0.55), space)
        top = _top(space, z)
        pole = np.array([[*top[:2], 0.0], top])
        cap = np.array([top, top + np.array([0.0, 0.0, 0.05])])
        place(vis[f"{name}/pole"], joined([tube(pole, 0.5 * radius), tube(cap, 3.0 * radius)]), Paint(INK))


def stage_labels(film: Film, space: Space) -> list[dict[str, Any]]:
    """Texts of the scene and where they stand, for the page."""
    x, y = space.corner()
    labels: list[dict[str, Any]] = [
        {"text": text, "at": [float(x), float(y), float(space.height(theta))], "small": True}
        for theta, text in _TICKS
    ]
    for name, z in _ends(film).items():
        top = _top(space, z) + np.array([0.0, 0.0, 0.35])
        labels.append({"text": name, "at": [float(value) for value in top], "small": False})
    return labels


def _ends(film: Film) -> dict[str, FloatArray]:
    fixed = [
        q if goal is None else goal
        for q, goal in zip(film.problem.start[3:], film.problem.goal_joints, strict=True)
    ]
    return {"start": film.problem.start, "goal": np.array([*film.problem.goal_pose, *fixed])}


def _top(space: Space, z: FloatArray) -> FloatArray:
    theta = np.array([on_turn((float(z[2]) - 1e-6, float(z[2]) + 1e-6))[0][0]])
    top: FloatArray = space.points(z[None, :2], theta)[0]
    return top


def _put(
    vis: Any, shapes: Sequence[Polygon], heights: tuple[float, float], paint: Paint, space: Space
) -> None:
    meshes = [
        prism(CrossSection(polygon_rings(shape), FillRule.Positive), *heights, coarse=1e-4 * space.extent)
        for shape in shapes
    ]
    vertices, faces = joined(meshes)
    place(vis, (space.flat(vertices), faces), paint)
