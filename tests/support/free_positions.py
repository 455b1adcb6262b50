"""Exact free positions at fixed angles, thousands at once: an oracle for the planner's cells.

It knows nothing of sweeps or of Minkowski differences as regions: a convex piece at p meets a wall edge e
exactly where p lies no further than the piece's radius from the hull of ``e - piece``.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from coop_drake.tree.component_tree import ComponentTree


def wall_edges(workspace: Polygon | MultiPolygon) -> np.ndarray:
    """End points of all edges of all rings, shape (E, 2, 2) [m]."""
    rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(workspace))]
    return np.concatenate([np.stack((ring[:-1], ring[1:]), axis=1) for ring in rings])


class FreePositions:
    """Where the object's origin may stand while theta and all joints keep their values.

    Args:
        tree: The team.
        workspace: W, closed; touching its boundary counts as a collision.
        angles: (theta, q...), shape (1 + n,) [rad, m].

    Attributes:
        touching: Whether two bodies touch at these angles, wherever the team stands.
    """

    def __init__(
        self, tree: ComponentTree, workspace: Polygon | MultiPolygon, angles: Sequence[float] | np.ndarray
    ) -> None:
        self._workspace = workspace
        shapely.prepare(workspace)
        self._walls = wall_edges(workspace)
        poses = tree.poses((0.0, 0.0, *angles))
        placed = {
            (c, b): [(X_WC.apply(shape.vertices), shape.radius) for shape in body.shapes]
            for c, (component, X_WC) in enumerate(zip(tree.components, poses, strict=True))
            for b, body in enumerate(component.bodies)
        }
        self.pieces = [piece for pieces in placed.values() for piece in pieces]
        self.touching = self._touching(tree, [body for body, pieces in placed.items() for _ in pieces])
        self._rims = np.array(
            [
                (*v, *w, r)
                for ring, r in self.pieces
                for v, w in zip(ring, np.roll(ring, -1, axis=0), strict=True)
            ]
        )
        self._hulls = {
            radius: STRtree(np.concatenate([self._less(v) for v, r in self.pieces if r == radius]))
            for radius in sorted({r for _, r in self.pieces})
        }

    def _touching(self, tree: ComponentTree, bodies: list[tuple[int, int]]) -> bool:
        """Whether the pieces of two bodies that must stay apart come as near as their radii."""
        forbidden = set(tree.collision_pairs)
        pairs = [(i, j) for (i, a), (j, b) in combinations(enumerate(bodies), 2) if (a, b) in forbidden]
        first, second = np.array(pairs, dtype=int).reshape(-1, 2).T
        cores = np.array([_hulls(vertices) for vertices, _ in self.pieces])
        radii = np.array([radius for _, radius in self.pieces])
        return bool((shapely.distance(cores[first], cores[second]) <= radii[first] + radii[second]).any())

    def _less(self, vertices: np.ndarray) -> np.ndarray:
        """Hulls of ``e - piece`` for all edges e, without the radius."""
        corners = self._walls[:, :, None, :] - vertices[None, None, :, :]
        return _hulls(corners.reshape(len(corners), -1, 2))

    def free(self, positions: np.ndarray) -> np.ndarray:
        """Whether the team touches neither a wall nor itself at each position; shape (k, 2) to (k,)."""
        if self.touching:
            return np.zeros(len(positions), dtype=bool)
        result = np.ones(len(positions), dtype=bool)
        for vertices, _ in self.pieces:
            result &= shapely.contains_xy(self._workspace, positions + vertices[0])
        for radius, hulls in self._hulls.items():
            left = np.flatnonzero(result)
            hit, _ = hulls.query(shapely.points(positions[left]), predicate="dwithin", distance=radius)
            result[left[hit]] = False
        return result

    def contacts(self, random: np.random.Generator, count: int) -> np.ndarray:
        """Positions at which some piece's rim meets some wall, a hair aside; shape (count, 2) [m]."""
        ends = self._walls[random.integers(len(self._walls), size=count)]
        share = np.clip(random.uniform(-0.2, 1.2, count), 0.0, 1.0)[:, None]
        walls = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
        number, along = (
            random.integers(len(self._rims), size=count),
            np.clip(random.uniform(-0.5, 1.5, count), 0, 1),
        )
        first, last, radius = self._rims[number, :2], self._rims[number, 2:4], self._rims[number, 4:]
        rims = first + along[:, None] * (last - first) + radius * _directions(random, count)
        return walls - rims + nudges(random, count)


def nudges(random: np.random.Generator, count: int) -> np.ndarray:
    """Displacements in every direction, from 0.1 um to 10 cm; shape (count, 2) [m]."""
    return 10.0 ** random.uniform(-7.0, -1.0, (count, 1)) * _directions(random, count)


def _directions(random: np.random.Generator, count: int) -> np.ndarray:
    turn = random.uniform(0.0, 2.0 * np.pi, count)
    return np.column_stack((np.cos(turn), np.sin(turn)))


def _hulls(points: np.ndarray) -> np.ndarray:
    """Convex hulls of point sets, shape (..., n, 2) to (...)."""
    closed = np.concatenate((points, points[..., :1, :]), axis=-2)  # a line needs two points
    hulls: np.ndarray = shapely.convex_hull(shapely.linestrings(closed))
    return hulls
