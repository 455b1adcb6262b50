"""How far every body is from the walls and from the bodies that it must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import edges_of
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import ComponentTree
from coop_drake.simulation.convex_distance import nearest_pair, nearest_to_walls, place_vertices

__all__ = ["Clearance", "TeamClearance"]


@dataclass(frozen=True)
class Clearance:
    """A smallest distance and where it is.

    Attributes:
        distance: Signed distance, negative where bodies penetrate [m].
        place: What it lies between, for example ``robot_0::base and the walls``.
    """

    distance: float
    place: str


class TeamClearance:
    """Exact distances of the team's convex pieces to the walls and to each other.

    Args:
        workspace: The floor; its rings are the walls [m].
        tree: The team's bodies and how they hang together.

    Raises:
        GeometryError: The tree has no shape at all.
    """

    def __init__(self, workspace: Polygon, tree: ComponentTree) -> None:
        self._tree = tree
        self._walls = np.ascontiguousarray(edges_of(workspace))
        self._names: list[str] = []
        radii: list[float] = []
        bounds: list[tuple[int, int]] = []
        vertices: list[FloatArray] = []
        component_of_vertex: list[int] = []
        pieces_of_body: dict[tuple[int, int], list[int]] = {}
        for c, component in enumerate(tree.components):
            for b, body in enumerate(component.bodies):
                for shape in body.shapes:
                    first = len(component_of_vertex)
                    vertices.append(np.asarray(shape.vertices, dtype=float))
                    component_of_vertex += [c] * len(shape.vertices)
                    pieces_of_body.setdefault((c, b), []).append(len(self._names))
                    self._names.append(body.name)
                    radii.append(float(shape.radius))
                    bounds.append((first, len(component_of_vertex)))
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self._local = np.ascontiguousarray(np.vstack(vertices))
        self._component: NDArray[np.int64] = np.array(component_of_vertex, dtype=np.int64)
        self._radii, self._bounds = np.array(radii), np.array(bounds, dtype=np.int64)
        self._pairs = np.array(
            [
                (i, j)
                for first_body, second_body in tree.collision_pairs
                for i in pieces_of_body.get(first_body, [])
                for j in pieces_of_body.get(second_body, [])
            ],
            dtype=np.int64,
        )

    def __call__(self, configuration: FloatArray) -> tuple[Clearance, Clearance]:
        """Smallest distance to the walls, and between bodies that must not touch (infinite if none are).

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        poses = np.array([(X.x, X.y, X.angle) for X in self._tree.poses(configuration)])
        placed = place_vertices(self._local, self._component, poses)
        distance, piece = nearest_to_walls(placed, self._bounds, self._radii, self._walls)
        walls = Clearance(distance, f"{self._names[piece]} and the walls")
        if not len(self._pairs):
            return walls, Clearance(float("inf"), "no two bodies")
        distance, pair = nearest_pair(placed, self._bounds, self._radii, self._pairs)
        first, second = (self._names[piece] for piece in self._pairs[pair])
        return walls, Clearance(distance, f"{first} and {second}")
