"""The exact answer for rigid bodies, up to a stated hair: free positions layer by layer of theta.

Between two layers a body stays within its reach times half their distance of where it is at one of them. With
the body grown by that hair a way through the layers is a way for the body; with the body shrunk by it, no way
through the layers means that there is none. GEOS computes the layers: nothing is shared with the planner.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Point, Polygon
from shapely.affinity import rotate

from tests.support.free_positions import wall_edges


def is_joined(
    floor: Polygon, body: Polygon, start: np.ndarray, goal: np.ndarray, layers: int, hair: float
) -> bool:
    """Whether layers of free positions join two poses (x, y, theta).

    Args:
        floor: W.
        body: A convex body in its own frame, about the origin that its pose is measured at.
        start: First pose, shape (3,).
        goal: Last pose, shape (3,).
        layers: How many angles of a whole turn.
        hair: How much to grow the body at each of them, negative to shrink it [m].
    """
    angles = 2.0 * np.pi * np.arange(layers) / layers
    parts = [list(shapely.get_parts(_free(floor, body, angle, hair))) for angle in angles]
    first = np.concatenate(([0], np.cumsum([len(part) for part in parts])))
    edges = [
        (first[i] + a, first[(i + 1) % layers] + b)
        for i in range(layers)
        for a, one in enumerate(parts[i])
        for b, other in enumerate(parts[(i + 1) % layers])
        if one.intersects(other)
    ]
    rows, columns = np.array(edges, dtype=int).reshape(-1, 2).T
    size = int(first[-1])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    labels = connected_components(graph, directed=False)[1] if size else np.zeros(0, dtype=int)

    def touched(pose: np.ndarray) -> set[int]:
        layer = int(np.rint(pose[2] / (2.0 * np.pi) * layers)) % layers
        here = Point(pose[:2])
        return {int(labels[first[layer] + k]) for k, part in enumerate(parts[layer]) if part.intersects(here)}

    return bool(touched(start) & touched(goal))


def _free(floor: Polygon, body: Polygon, angle: float, hair: float) -> shapely.Geometry:
    """Positions at which the body fits, grown by a hair."""
    turned = rotate(body, angle, origin=(0.0, 0.0), use_radians=True).buffer(hair, join_style="mitre")
    if turned.is_empty:
        return floor
    vertices = shapely.get_coordinates(turned)[:-1]
    corners = (wall_edges(floor)[:, :, None, :] - vertices).reshape(-1, 2 * len(vertices), 2)
    walls = shapely.union_all(shapely.convex_hull(shapely.linestrings(corners)))
    return shapely.affinity.translate(floor, *-vertices[0]).difference(walls)
