"""The medial graph of a polygon: the Voronoi graph of samples of its boundary, as far as it lies inside.

scipy's graphs and triangulations are imported where they are used: to read a scenario takes neither.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.geometry.boundary import BoundaryDistance, edges_of
from coop_drake.geometry.edge_pieces import IndexArray, cut_edges
from coop_drake.tree.pose import FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

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
    """Build the medial graph.

    Args:
        polygon: The region, with holes or without [m].
        distance: Distance to its boundary.

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


def widest_path(graph: Graph, start: int, end: int) -> IndexArray | None:
    """Nodes of the path whose narrowest edge is widest, the shortest one among equally wide.

    Args:
        graph: The graph; no edge occurs twice.
        start: Index of the first node.
        end: Index of the last node.

    Returns:
        Indices of the nodes, or None where no path exists.
    """
    from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree

    count = len(graph.nodes)
    # The widest path runs inside the spanning tree of greatest clearance; its weights must be positive.
    tree = minimum_spanning_tree(_matrix(graph.pairs, 1.0 + graph.clearance.max() - graph.clearance, count))
    _, before = breadth_first_order(tree, start, directed=False)
    chain = _trace(before, start, end)
    if chain is None:
        return None
    rows = {frozenset(pair): k for k, pair in enumerate(graph.pairs.tolist())}
    widest = min(
        graph.clearance[rows[frozenset(pair)]]
        for pair in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True)
    )
    wide = graph.clearance >= widest
    weights = _matrix(graph.pairs[wide], graph.length[wide] + 1e-9, count)
    _, shortest = dijkstra(weights, directed=False, indices=np.array(start), return_predecessors=True)
    return _trace(shortest, start, end)


def _matrix(pairs: IndexArray, weights: FloatArray, count: int) -> csr_matrix:
    from scipy.sparse import csr_matrix

    return csr_matrix((weights, (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _trace(before: NDArray[np.integer], start: int, end: int) -> IndexArray | None:
    chain = [end]
    while chain[-1] != start:
        previous = int(before[chain[-1]])
        if previous < 0:
            return None
        chain.append(previous)
    return np.array(chain[::-1], dtype=np.intp)


def _voronoi(samples: FloatArray) -> tuple[FloatArray, IndexArray, IndexArray]:
    """Voronoi vertices (n, 2), which pairs of them edges join, and which samples stand beside each edge."""
    from scipy.spatial import Delaunay

    # Centred, so that far-away samples lose no digits in the lifted paraboloid.
    centre = samples.mean(axis=0)
    delaunay = Delaunay(samples - centre)
    corners = delaunay.points[delaunay.simplices]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice_area = 2.0 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    flat = np.abs(twice_area) < 1e-14
    twice_area[flat] = np.inf
    uu, vv = (u * u).sum(axis=1), (v * v).sum(axis=1)
    offset = (
        np.stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu], axis=1) / twice_area[:, None]
    )
    nodes = corners[:, 0] + offset + centre
    first = np.repeat(np.arange(len(nodes)), 3)
    second = delaunay.neighbors.ravel().astype(np.intp)
    walls = delaunay.simplices[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2).astype(np.intp)
    once = (first < second) & ~flat[first] & ~flat[second]
    return nodes, np.stack([first[once], second[once]], axis=1), walls[once]


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
