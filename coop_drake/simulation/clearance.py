"""How far every body is from the walls and from the bodies that it must not touch."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import edges_of
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import ComponentTree
from coop_drake.simulation.convex_distance import core_distance, place_vertices, wall_distance

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
        self._radii: list[float] = []
        self._bounds: list[tuple[int, int]] = []
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
                    self._radii.append(float(shape.radius))
                    self._bounds.append((first, len(component_of_vertex)))
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self._local = np.ascontiguousarray(np.vstack(vertices))
        self._component: NDArray[np.int64] = np.array(component_of_vertex, dtype=np.int64)
        self._pairs = tuple(
            (i, j)
            for first_body, second_body in tree.collision_pairs
            for i in pieces_of_body.get(first_body, [])
            for j in pieces_of_body.get(second_body, [])
        )

    def __call__(self, configuration: FloatArray) -> tuple[Clearance, Clearance]:
        """Smallest distance to the walls, and between bodies that must not touch (infinite if none are).

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        poses = np.array([(X.x, X.y, X.angle) for X in self._tree.poses(configuration)])
        placed = place_vertices(self._local, self._component, poses)
        cores = [placed[first:last] for first, last in self._bounds]
        return self._to_walls(cores), self._between_bodies(cores)

    def _to_walls(self, cores: list[FloatArray]) -> Clearance:
        distances = [
            wall_distance(core, self._walls) - radius for core, radius in zip(cores, self._radii, strict=True)
        ]
        nearest = _argmin(distances)
        return Clearance(distances[nearest], f"{self._names[nearest]} and the walls")

    def _between_bodies(self, cores: list[FloatArray]) -> Clearance:
        if not self._pairs:
            return Clearance(float("inf"), "no two bodies")
        distances = [
            core_distance(cores[i], cores[j]) - self._radii[i] - self._radii[j] for i, j in self._pairs
        ]
        i, j = self._pairs[_argmin(distances)]
        return Clearance(min(distances), f"{self._names[i]} and {self._names[j]}")


def _argmin(values: Iterable[float]) -> int:
    return min(enumerate(values), key=lambda entry: entry[1])[0]
