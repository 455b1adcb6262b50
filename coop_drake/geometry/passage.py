"""Widest passages through a polygon: the clearance that a path can keep, its length, its narrowest place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import LineString, Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.edge_pieces import IndexArray
from coop_drake.geometry.medial import Graph, medial_graph, widest_path
from coop_drake.geometry.triangles import triangulate
from coop_drake.tree.pose import FloatArray

POLE = 1e-3
"""How much more clearance than the pole another point may have [m]; less where the polygon is thin."""

LEAST = 1e-9
"""Passages with less clearance are not told from what rounding leaves of walls that touch [m]."""

LINKS = 24
"""An end is linked to this many nearest nodes of the medial graph, besides those whose disc holds it."""


@dataclass(frozen=True)
class Passage:
    """A path between two points of a polygon that keeps as much clearance as any path found.

    Attributes:
        path: From the one point to the other [m].
        clearance: Smallest distance of the path to the boundary, exact for this path [m].
        narrowest: Point of the path where that is, shape (2,) [m].
    """

    path: LineString
    clearance: float
    narrowest: FloatArray

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self.path.length)


class PassageFinder:
    """Answers for one polygon, on its medial graph, how widely two points are joined.

    Args:
        polygon: The region, with holes or without [m].
    """

    def __init__(self, polygon: Polygon) -> None:
        self._polygon = polygon
        self._distance = BoundaryDistance(polygon)

    @cached_property
    def _medial(self) -> tuple[Graph, FloatArray]:
        """The medial graph and the clearance of its nodes; most questions are answered without it."""
        return medial_graph(self._polygon, self._distance)

    def find(self, start: ArrayLike, end: ArrayLike) -> Passage:
        """Widest passage between two points, (2,) each [m], the shortest one among equally wide.

        Raises:
            GeometryError: If an end lies outside, or no passage joins them.
        """
        ends = np.array([start, end], dtype=float)
        widest = min(self._distance(ends[0]), self._distance(ends[1]))
        if widest <= 0.0:
            raise GeometryError(
                f"the ends {_text(ends[0])} and {_text(ends[1])} of a passage must lie inside"
            )
        straight = self._measure(ends)
        if straight.clearance >= widest:
            return straight
        graph = self._linked(ends)
        chain = widest_path(graph, len(graph.nodes) - 2, len(graph.nodes) - 1)
        best = self._wider(straight, graph.nodes, chain)
        if best.clearance <= 0.0:  # The passage is narrower than samples of the boundary can tell.
            graph = self._across_triangles(ends)
            chain = widest_path(graph, len(graph.nodes) - 2, len(graph.nodes) - 1)
            best = self._wider(best, graph.nodes, chain)
        if best.clearance < LEAST:
            raise GeometryError(f"no passage joins {_text(ends[0])} and {_text(ends[1])}")
        return best

    def _linked(self, ends: FloatArray) -> Graph:
        """The medial graph with the ends as its last two nodes."""
        medial, clearance_there = self._medial
        graph = replace(medial, nodes=np.vstack([medial.nodes, ends]))
        for k, end in enumerate(ends):
            away = np.linalg.norm(medial.nodes - end, axis=1)
            away[clearance_there <= 0.0] = np.inf
            least = min(LINKS, len(away)) - 1
            close = np.flatnonzero(away <= np.partition(away, least)[least])
            near = close[np.argsort(away[close], kind="stable")][:LINKS]
            nodes = np.union1d(near[np.isfinite(away[near])], np.flatnonzero(away <= clearance_there))
            clearance = self._distance.along(np.tile(end, (len(nodes), 1)), graph.nodes[nodes])
            seen = clearance > 0.0
            graph = replace(
                graph,
                pairs=np.vstack(
                    [graph.pairs, np.stack([nodes, np.full_like(nodes, len(medial.nodes) + k)], axis=1)[seen]]
                ),
                clearance=np.append(graph.clearance, clearance[seen]),
                length=np.append(graph.length, away[nodes][seen]),
            )
        return graph

    def _across_triangles(self, ends: FloatArray) -> Graph:
        """The graph of the middles of a triangulation's diagonals, with the ends as its last two nodes.

        Those of one triangle are joined by edges. It has a path through every passage, however narrow.
        """
        parts = triangulate(self._polygon)
        nodes = np.vstack([parts.vertices[parts.diagonals].mean(axis=1), ends])
        triangles = [Polygon(corners) for corners in parts.vertices[parts.corners]]
        held: list[list[int]] = [[] for _ in triangles]
        for place, neighbours in enumerate(parts.neighbours):
            for k in neighbours:
                held[k].append(place)
        for place, end in enumerate(ends, len(parts.diagonals)):
            for k in np.flatnonzero(shapely.intersects_xy(triangles, *end)):
                held[k].append(place)
        pairs = np.array([pair for places in held for pair in combinations(places, 2)]).reshape(-1, 2)
        first, second = nodes[pairs[:, 0]], nodes[pairs[:, 1]]
        clearance = self._distance.along(first, second)
        inside = clearance > 0.0
        length = np.linalg.norm(second - first, axis=1)
        return Graph(nodes, pairs[inside], clearance[inside], length[inside])

    def _wider(self, passage: Passage, nodes: FloatArray, chain: IndexArray | None) -> Passage:
        """The wider one of a passage and a chain of nodes, if there is a chain."""
        if chain is None:
            return passage
        other = self._measure(self._distance.shortened(nodes[chain]))
        return max(passage, other, key=lambda passage: passage.clearance)

    def _measure(self, points: FloatArray) -> Passage:
        clearances = self._distance.along(points[:-1], points[1:])
        worst = int(np.argmin(clearances))
        segment = LineString(points[worst : worst + 2])
        narrowest = shapely.get_coordinates(shapely.shortest_line(segment, self._polygon.boundary))[0]
        return Passage(LineString(points), float(clearances[worst]), narrowest)


def pole(polygon: Polygon) -> tuple[FloatArray, float]:
    """Pole of inaccessibility: the point of a polygon farthest from its boundary.

    Returns:
        The point, shape (2,) [m], and its clearance [m].

    Raises:
        GeometryError: If the polygon has no interior.
    """
    if polygon.is_empty or polygon.area <= 0.0:
        raise GeometryError("a polygon without area has no pole of inaccessibility")
    half_width = polygon.area / polygon.length
    # Edges that are shorter than floating point can tell divide by zero inside GEOS, without harm.
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = shapely.maximum_inscribed_circle(polygon, tolerance=min(POLE, 0.1 * half_width))
    centre = shapely.get_coordinates(radius)[0]
    return centre, BoundaryDistance(polygon)(centre)


def _text(point: FloatArray) -> str:
    return f"({point[0]:.4f}, {point[1]:.4f})"
