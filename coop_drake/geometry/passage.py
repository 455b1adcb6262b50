"""Widest passages through a polygon: the clearance that a path can keep, its length, its narrowest place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from heapq import heappop, heappush
from itertools import combinations
from math import inf, sqrt

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import LineString, Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.polygons import BoundaryDistance, edges_of, extent_of, squared_distance
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

# Cuts the edges of rings into pieces that are short where the opposite wall is near.

IndexArray = NDArray[np.intp]


@compiled
def cut_edges(
    edges: FloatArray, shortest: float, coarsest: float, per_gap: float
) -> tuple[FloatArray, IndexArray]:
    """Halve every edge until its pieces are short against their distance to the opposite wall.

    Args:
        edges: Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m].
        shortest: Pieces of this length are not halved [m].
        coarsest: Longer pieces are halved, however far the opposite wall is [m].
        per_gap: Least number of pieces on a stretch as long as its distance to the opposite wall [-].

    Returns:
        Starts of the pieces in order, shape (n, 2) [m], and the edge of each, shape (n,).
    """
    starts = [(edges[0, 0], edges[0, 1])]
    owners = [0]
    for k in range(edges.shape[0]):
        x0, y0, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2] - edges[k, 0], edges[k, 3] - edges[k, 1]
        length = sqrt(dx * dx + dy * dy)
        stack = [(0.0, 1.0)]
        while len(stack) > 0:
            s, t = stack.pop()
            # Distance of the piece's middle to the nearest edge that does not touch its own.
            x, y, squared = x0 + 0.5 * (s + t) * dx, y0 + 0.5 * (s + t) * dy, np.inf
            for j in range(edges.shape[0]):
                ax, ay, bx, by = edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3]
                touches = False
                for end in (0, 2):
                    u, v = edges[k, end], edges[k, end + 1]
                    touches = touches or (ax == u and ay == v) or (bx == u and by == v)
                if not touches:
                    squared = min(squared, squared_distance(x, y, ax, ay, bx, by))
            gap = sqrt(squared)
            if (t - s) * length > max(shortest, min(coarsest, gap / per_gap)):
                stack.append((0.5 * (s + t), t))
                stack.append((s, 0.5 * (s + t)))
            else:
                starts.append((x0 + s * dx, y0 + s * dy))
                owners.append(k)
    return np.array(starts[1:]), np.array(owners[1:])


# Triangles of a polygon between points of its rings, fine enough that diagonals cross passages squarely.

PIECES_PER_GAP = 1.0
"""Least number of pieces on a stretch of a ring as long as its distance to the opposite wall [-]."""

FINEST = 500
"""Size of the polygon over the length of the shortest pieces [-]; finer passages get oblique diagonals."""


@dataclass(frozen=True)
class Triangles:
    """A triangulation of a polygon.

    Attributes:
        vertices: Points of the rings, shape (n, 2) [m].
        ring: Ring of each vertex, 0 for the outer one, shape (n,).
        corners: Vertices of each triangle, shape (t, 3).
        diagonals: Vertices of the edges between two triangles, shape (d, 2).
        neighbours: The two triangles on either side of them, shape (d, 2).
    """

    vertices: FloatArray
    ring: IndexArray
    corners: IndexArray
    diagonals: IndexArray
    neighbours: IndexArray


def triangulate(polygon: Polygon) -> Triangles:
    """Triangulate a polygon, its rings cut into pieces that are short where the opposite wall is near."""
    polygon = shapely.remove_repeated_points(polygon)
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    pieces, owners = cut_edges(edges_of(polygon), extent_of(polygon) / FINEST, np.inf, PIECES_PER_GAP)
    ring_of = np.repeat(np.arange(len(sizes)), sizes)[owners]
    cut = [pieces[ring_of == k] for k in range(len(sizes))]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(Polygon(cut[0], cut[1:])))
    vertices, first = np.unique(pieces, axis=0, return_index=True)
    places = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    known, corners = np.unique(np.vstack((vertices, places.reshape(-1, 2))), axis=0, return_inverse=True)
    assert len(known) == len(vertices)  # no triangle has a corner of its own
    corners = corners.ravel()[len(vertices) :].reshape(-1, 3)
    sides = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(corners)), 3)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    twice = np.flatnonzero((sides[1:] == sides[:-1]).all(axis=1))
    return Triangles(
        vertices, ring_of[first], corners, sides[twice], np.column_stack((owner[twice], owner[twice + 1]))
    )


# The medial graph of a polygon: the Voronoi graph of samples of its boundary, as far as it lies inside.

SHORTEST_SAMPLE = 2e-3
"""The boundary is sampled no finer than this [m]; narrower passages are still measured exactly."""

SAMPLES_PER_CLEARANCE = 2.0
"""Samples on a stretch of boundary as long as its distance to the opposite wall."""

SAMPLES_PER_BOUNDARY = 64.0
"""Samples on a boundary that has no opposite wall, such as a triangle's."""


@dataclass(frozen=True)
class Graph:
    """An undirected graph in the plane.

    Attributes:
        nodes: Positions, shape (n, 2) [m].
        pairs: Ends of the edges, shape (edges, 2).
        clearance: Smallest distance of each edge to the boundary, shape (edges,) [m].
        length: Length of each edge, shape (edges,) [m].
    """

    nodes: FloatArray
    pairs: IndexArray
    clearance: FloatArray
    length: FloatArray


def medial_graph(polygon: Polygon, distance: BoundaryDistance) -> tuple[Graph, FloatArray]:
    """Build the medial graph of a region, with holes or without, given the distance to its boundary.

    Returns:
        The graph, and the clearance of each node, shape (n,) [m], not positive for nodes outside.
    """
    samples, successor = _samples_of(polygon)
    nodes, pairs, walls = _voronoi(samples)
    node_clearance = distance.batch(nodes)
    # The Voronoi edge between two consecutive samples crosses the boundary.
    through = (successor[walls[:, 0]] == walls[:, 1]) | (successor[walls[:, 1]] == walls[:, 0])
    kept = ~through & (node_clearance[pairs] > 0.0).all(axis=1)
    pairs, walls = pairs[kept], walls[kept]
    first, second = nodes[pairs[:, 0]], nodes[pairs[:, 1]]
    length = np.linalg.norm(second - first, axis=1)
    # The edge is closest to its two walls where it passes between them.
    middle = 0.5 * (samples[walls[:, 0]] + samples[walls[:, 1]])
    along = ((middle - first) * (second - first)).sum(axis=1) / np.maximum(length**2, 1e-30)
    gate = first + np.clip(along, 0.0, 1.0)[:, None] * (second - first)
    clearance = np.minimum(node_clearance[pairs].min(axis=1), distance.batch(gate))
    inside = clearance > 0.0
    return Graph(nodes, pairs[inside], clearance[inside], length[inside]), node_clearance


def widest_path(graph: Graph, start: int, end: int) -> list[int] | None:
    """Nodes of the path whose narrowest edge is widest, the shortest among equally wide, or None.

    Edges are added from the widest to the narrowest until they join the nodes, with all that are as wide as
    the last one. Among these Dijkstra's algorithm finds the shortest path.
    """
    order = np.argsort(-graph.clearance, kind="stable")
    edges = zip(
        graph.pairs[order].tolist(),
        graph.clearance[order].tolist(),
        graph.length[order].tolist(),
        strict=True,
    )
    around: list[list[tuple[int, float]]] = [[] for _ in graph.nodes]
    joined_to, narrowest = list(range(len(graph.nodes))), -inf

    def root(node: int) -> int:
        """The node that stands for all that a node is joined to; paths to it become shorter."""
        while joined_to[node] != node:
            joined_to[node] = joined_to[joined_to[node]]
            node = joined_to[node]
        return node

    for (one, other), clearance, length in edges:
        if clearance < narrowest:
            break
        around[one].append((other, length))
        around[other].append((one, length))
        joined_to[root(one)] = root(other)
        if narrowest == -inf and root(start) == root(end):
            narrowest = clearance
    if narrowest == -inf:
        return None
    before, distance, waiting = {start: start}, {start: 0.0}, [(0.0, start)]
    while waiting:
        reached, node = heappop(waiting)
        if node == end:
            break
        if reached > distance[node]:
            continue
        for other, length in around[node]:
            if reached + length < distance.get(other, inf):
                distance[other], before[other] = reached + length, node
                heappush(waiting, (reached + length, other))
    chain = [end]
    while chain[-1] != start:
        chain.append(before[chain[-1]])
    return chain[::-1]


def _voronoi(samples: FloatArray) -> tuple[FloatArray, IndexArray, IndexArray]:
    """Voronoi vertices (n, 2), which pairs of them edges join, and which samples stand beside each edge."""
    # Centred, so that far-away samples lose no digits.
    centre = samples.mean(axis=0)
    points = samples - centre
    triangles = shapely.delaunay_triangles(shapely.multipoints(points))
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    simplices = _indices(points, corners)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice_area = 2.0 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    flat = np.abs(twice_area) < 1e-14
    twice_area[flat] = np.inf
    uu, vv = (u * u).sum(axis=1), (v * v).sum(axis=1)
    offset = (
        np.stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu], axis=1) / twice_area[:, None]
    )
    nodes = corners[:, 0] + offset + centre
    # A side that two triangles share is dual to the Voronoi edge between their nodes.
    sides = np.sort(simplices[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    shared = np.flatnonzero((sides[order[:-1]] == sides[order[1:]]).all(axis=1))
    first, second = order[shared] // 3, order[shared + 1] // 3
    kept = ~flat[first] & ~flat[second]
    return nodes, np.stack([first[kept], second[kept]], axis=1), sides[order[shared]][kept]


def _indices(points: FloatArray, corners: FloatArray) -> IndexArray:
    """Which of some points, shape (n, 2), stand at the corners of triangles, shape (m, 3, 2)."""
    keys, wanted = points[:, 0] + 1j * points[:, 1], corners[..., 0] + 1j * corners[..., 1]
    order = np.argsort(keys, kind="stable")
    found: IndexArray = order[np.searchsorted(keys[order], wanted)]
    return found


def _samples_of(polygon: Polygon) -> tuple[FloatArray, IndexArray]:
    """Samples of every ring, shape (n, 2), and for each the index of the next one on its ring, shape (n,)."""
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    coarsest = polygon.exterior.length / SAMPLES_PER_BOUNDARY
    samples, owners = cut_edges(edges_of(polygon), SHORTEST_SAMPLE, coarsest, SAMPLES_PER_CLEARANCE)
    rings = np.repeat(np.arange(len(sizes)), sizes)[owners]
    successor = np.arange(1, len(samples) + 1)
    for ring in range(len(sizes)):
        members = np.flatnonzero(rings == ring)
        successor[members[-1]] = members[0]
    return samples, successor


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

    def _wider(self, passage: Passage, nodes: FloatArray, chain: list[int] | None) -> Passage:
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
