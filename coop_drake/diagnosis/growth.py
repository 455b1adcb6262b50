"""Floors with more room: walls moved back, everywhere or round one place, but never broken through."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import QhullError, Voronoi
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.pose import FloatArray

__all__ = ["Growth"]

_SAMPLES = 6_000
_FINEST = 0.01
_OPPOSITE = 1.6
_CORE = 5e-4
_HAIR = 1e-6
_MITRE = 5.0
_BEYOND = 1.5


class Growth:
    """Moves the walls of a floor back.

    Every wall recedes along its normal, corners stay sharp. A wall that stands between two parts of the floor
    keeps its middle line however thin it is: moving walls back never opens a way through them. Where such
    a line ends, at the jamb of a door or at the end of a partition, it recedes with the wall's end.

    Args:
        workspace: The floor W [m].
        inside: A point of W that the grown floor must hold, shape (2,) [m].
        most: Largest amount that will be asked for [m].
    """

    def __init__(self, workspace: Polygon, inside: FloatArray, most: float) -> None:
        self._workspace, self._inside, self.most = workspace, Point(inside), most

    def everywhere(self, amount: float) -> Polygon:
        """The floor with every wall moved back [m]."""
        return self._joined(self._grown(amount))

    def around(self, zones: list[tuple[BaseGeometry, float]]) -> Polygon:
        """The floor with walls moved back inside some zones only, each by its own amount [m]."""
        parts = [self._grown(amount).intersection(zone) for zone, amount in zones if amount > 0.0]
        return self._joined(shapely.union_all([self._workspace, *parts]))

    def _grown(self, amount: float) -> BaseGeometry:
        if amount <= 0.0:
            return self._workspace
        grown = self._workspace.buffer(amount, join_style="mitre", mitre_limit=_MITRE)
        return shapely.union(shapely.difference(grown, self._middle_lines(amount)), self._workspace)

    def _middle_lines(self, amount: float) -> BaseGeometry:
        """What is left of the walls' middle lines when their ends have receded."""
        lines, ends = self._spine
        receded = [end.buffer(amount - room) for end, room in ends if amount > room]
        left = shapely.difference(lines, shapely.union_all(receded)) if receded else lines
        return left.buffer(_CORE, quad_segs=1)

    def _joined(self, shape: BaseGeometry) -> Polygon:
        """The part that holds the start, without hairs."""
        parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)]
        best = max(parts, key=lambda part: (part.contains(self._inside), part.area))
        tidy = best.simplify(_HAIR)
        return tidy if isinstance(tidy, Polygon) and tidy.is_valid else best

    @cached_property
    def _spine(self) -> tuple[BaseGeometry, list[tuple[Point, float]]]:
        """Middle lines of all walls that could be broken through, and their ends at jambs with their room.

        Where a line ends because the wall grows thick it is drawn on, half-way to the floor beyond.
        """
        edges, room = self._ridges
        if len(edges) == 0:
            return LineString(), []
        corners = edges.reshape(-1, 2)
        _, first, counts = np.unique(np.round(corners, 9), axis=0, return_index=True, return_counts=True)
        jambs, roots = [], []
        for index in first[counts == 1]:
            end, space = corners[index], float(room[index // 2])
            ahead = self._ahead(end, corners, space)
            if self._workspace.contains(Point(end + _BEYOND * space * ahead)):
                jambs.append((Point(end), space))
            else:
                roots.append(self._onwards(end, ahead))
        lines = shapely.union_all([*(LineString(edge) for edge in edges), *roots])
        return shapely.line_merge(lines).simplify(_CORE), jambs

    @staticmethod
    def _ahead(end: FloatArray, corners: FloatArray, room: float) -> FloatArray:
        """Direction in which a middle line ends, shape (2,)."""
        near = corners[np.hypot(*(corners - end).T) <= 2.0 * max(room, _FINEST)]
        back = end - near.mean(axis=0)
        ahead: FloatArray = back / max(float(np.hypot(*back)), 1e-12)
        return ahead

    def _onwards(self, end: FloatArray, ahead: FloatArray) -> LineString:
        """From an end half-way to the floor beyond, if there is any."""
        ray = LineString([end, end + 2.0 * self.most * ahead])
        blocked = shapely.intersection(ray, self._workspace)
        length = 2.0 * self.most if blocked.is_empty else blocked.distance(Point(end))
        return LineString([end, end + 0.5 * length * ahead])

    @cached_property
    def _ridges(self) -> tuple[FloatArray, FloatArray]:
        """Edges of the walls' Voronoi graph between opposite faces, shape (n, 2, 2), and their rooms (n,)."""
        samples = self._samples()
        try:
            graph = Voronoi(samples)
        except (QhullError, ValueError):
            return np.empty((0, 2, 2)), np.empty(0)
        ends = np.array(graph.ridge_vertices)
        faces = np.array(graph.ridge_points)
        kept = (ends >= 0).all(axis=1)
        edges, faces = graph.vertices[ends[kept]], faces[kept]
        middles = edges.mean(axis=1)
        room = np.hypot(*(middles - samples[faces[:, 0]]).T)
        apart = np.hypot(*(samples[faces[:, 1]] - samples[faces[:, 0]]).T)
        near = (room <= self.most) & (apart >= _OPPOSITE * room)
        edges, room = edges[near], room[near]
        outside = ~shapely.contains_xy(self._workspace, edges[:, 0]) & ~shapely.contains_xy(
            self._workspace, edges[:, 1]
        )
        return edges[outside], room[outside]

    def _samples(self) -> FloatArray:
        """Points of the walls, close enough to tell the faces of thin ones apart, shape (n, 2)."""
        boundary = self._workspace.boundary
        spacing = max(_FINEST, boundary.length / _SAMPLES)
        points = shapely.get_coordinates(shapely.segmentize(boundary, spacing))
        samples: FloatArray = np.unique(np.round(points, 9), axis=0)
        return samples
