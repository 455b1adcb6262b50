"""How far every body is from the walls and from the bodies that it must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import edges_of
from coop_drake.simulation.convex_distance import IntArray
from coop_drake.simulation.step_kernels import team_distances
from coop_drake.tree.component_tree import Component, ComponentTree
from coop_drake.tree.pose import FloatArray

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
        walls = np.ascontiguousarray(edges_of(workspace))
        self._names: list[str] = []
        pieces: list[tuple[float, float, float]] = []
        vertices: list[tuple[float, float, float]] = []
        pieces_of_body: dict[tuple[int, int], list[int]] = {}
        for c, component in enumerate(tree.components):
            for b, body in enumerate(component.bodies):
                for shape in body.shapes:
                    first = len(vertices)
                    vertices += [(float(c), float(x), float(y)) for x, y in shape.vertices]
                    pieces_of_body.setdefault((c, b), []).append(len(self._names))
                    self._names.append(body.name)
                    pieces.append((float(first), float(len(vertices)), float(shape.radius)))
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self._pairs: IntArray = np.array(
            [
                (i, j)
                for first_body, second_body in tree.collision_pairs
                for i in pieces_of_body.get(first_body, [])
                for j in pieces_of_body.get(second_body, [])
            ],
            dtype=np.int64,
        ).reshape(-1, 2)
        links = np.array([_link(component) for component in tree.components])
        self._arrays = links, np.array(vertices), np.array(pieces), self._pairs, walls

    @property
    def kernel_arguments(self) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, FloatArray]:
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
        if not len(self._pairs):
            return "no two bodies"
        first, second = (self._names[piece] for piece in self._pairs[pair])
        return f"{first} and {second}"


def _link(component: Component) -> tuple[float, ...]:
    """A component's row, see ``LINK_COLUMNS``."""
    joint = component.joint
    if component.parent is None or joint is None:
        return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    X_PJ, sliding = joint.X_PJ, joint.kind == "prismatic"
    motion = (0.0, *joint.axis) if sliding else (joint.sign, 0.0, 0.0)
    return float(component.parent), X_PJ.x, X_PJ.y, X_PJ.angle, float(3 + joint.index), *motion
