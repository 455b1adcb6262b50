"""Distances of all bodies to the walls of the floor and to the bodies that they must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import edges_of
from coop_drake.simulation.step_kernels import team_distances
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays


@dataclass(frozen=True)
class Clearance:
    """A smallest distance and where it is.

    Attributes:
        distance: Signed distance, negative where bodies penetrate [m].
        place: Between what, for example ``robot_0::base and the walls``.
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
        self._names = [
            body.name for component in tree.components for body in component.bodies for _ in body.shapes
        ]
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self._arrays = tree.arrays, np.ascontiguousarray(edges_of(workspace))

    @property
    def kernel_arguments(self) -> tuple[TeamArrays, FloatArray]:
        """The arguments of ``team_distances`` for this team and floor."""
        return self._arrays

    def __call__(self, configuration: FloatArray) -> tuple[Clearance, Clearance]:
        """Return the smallest distance to the walls, and between bodies that must not touch.

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        wall, piece, between, pair = team_distances(*self._arrays, configuration)
        return Clearance(wall, self.wall_place(piece)), Clearance(between, self.pair_place(pair))

    def wall_place(self, piece: int) -> str:
        """Return a phrase for the two sides of a piece's distance to the walls."""
        return f"{self._names[piece]} and the walls"

    def pair_place(self, pair: int) -> str:
        """Return a phrase for the two sides of a pair's distance."""
        pairs = self._arrays[0].pairs
        if not len(pairs):
            return "no two bodies"
        first, second = (self._names[piece] for piece in pairs[pair])
        return f"{first} and {second}"
