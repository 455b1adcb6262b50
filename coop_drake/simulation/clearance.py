"""How far every body is from the walls and from the bodies that it must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import edges_of
from coop_drake.simulation.step_kernels import team_distances
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, team_arrays

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
        self._names = [
            body.name for component in tree.components for body in component.bodies for _ in body.shapes
        ]
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self._arrays = team_arrays(tree), np.ascontiguousarray(edges_of(workspace))

    @property
    def kernel_arguments(self) -> tuple[TeamArrays, FloatArray]:
        """What the compiled distances read of team and floor, see ``team_distances``."""
        return self._arrays

    def __call__(self, configuration: FloatArray) -> tuple[Clearance, Clearance]:
        """Smallest distance to the walls, and between bodies that must not touch (infinite if none are).

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        wall, piece, between, pair = team_distances(*self._arrays, configuration)
        return Clearance(wall, self.wall_place(piece)), Clearance(between, self.pair_place(pair))

    def wall_place(self, piece: int) -> str:
        """What a piece's distance to the walls lies between."""
        return f"{self._names[piece]} and the walls"

    def pair_place(self, pair: int) -> str:
        """What the distance of a pair lies between."""
        pairs = self._arrays[0].pairs
        if not len(pairs):
            return "no two bodies"
        first, second = (self._names[piece] for piece in pairs[pair])
        return f"{first} and {second}"
