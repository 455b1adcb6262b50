"""What is computed of every accepted step, compiled, in few calls: handing an array over costs most."""

from __future__ import annotations

from math import cos, inf, sin

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.boundary import signed_distance
from coop_drake.simulation.convex_distance import IntArray, nearest_pair, nearest_to_walls
from coop_drake.tree.pose import FloatArray

__all__ = ["LINK_COLUMNS", "largest_difference", "margins", "team_distances"]

#: Columns of a component's row: parent's row (-1 for the object's), X_PJ [m, m, rad], where the joint's value
#: stands in z, how the joint's value turns the child (0 where it slides), direction of sliding in J.
LINK_COLUMNS = 8
_PARENT, _X, _Y, _ANGLE, _VALUE, _SIGN, _SLIDE_X, _SLIDE_Y = range(LINK_COLUMNS)


@compiled
def team_distances(
    links: FloatArray,
    vertices: FloatArray,
    pieces: FloatArray,
    pairs: IntArray,
    walls: FloatArray,
    z: FloatArray,
) -> tuple[float, int, float, int]:
    """Smallest distance to the walls and whose it is, smallest between bodies and which pair's it is.

    Args:
        links: Every component, parents first, shape (C, ``LINK_COLUMNS``).
        vertices: Component and place in it of all cores' vertices, shape (v, 3) [-, m, m].
        pieces: The cores, see ``nearest_to_walls``.
        pairs: Pieces that must not touch, shape (pairs, 2); the distance of none is infinite.
        walls: Every edge of the floor's rings as (x, y, x, y), shape (w, 4) [m].
        z: (x, y, theta, q...), shape (3 + n,) [m, rad].
    """
    placed = _placed(vertices, _poses(links, z))
    wall, piece = nearest_to_walls(placed, pieces, walls)
    between, pair = nearest_pair(placed, pieces, pairs)
    return wall, piece, between, pair


@compiled
def margins(
    links: FloatArray, vertices: FloatArray, pieces: FloatArray, pairs: IntArray, walls: FloatArray,
    z: FloatArray, cell: FloatArray, lower: FloatArray, upper: FloatArray,
    funnel_lower: FloatArray, funnel_upper: FloatArray, commanded: FloatArray, measured: FloatArray,
) -> tuple[float, int, float, int, float, float, int, float, int, float]:  # fmt: skip
    """What ``team_distances`` returns, then the other margins, for the axes also which one is nearest.

    Args:
        links: With the next five as in ``team_distances``.
        vertices: Of all cores.
        pieces: The cores.
        pairs: Pieces that must not touch.
        walls: Of the floor.
        z: The configuration.
        cell: Edges of the cell's safe set, shape (edges, 4) [m].
        lower: Of the cell's slice, shape (1 + n,) [rad or m].
        upper: Of the cell's slice, shape (1 + n,) [rad or m].
        funnel_lower: Lower walls of the funnels, shape (1 + n,) [rad or m].
        funnel_upper: Upper walls of the funnels, shape (1 + n,) [rad or m].
        commanded: Wrenches of the hands, shape (N, 3) [N, N m].
        measured: The same as the grasps transmit them, shape (N, 3) [N, N m].

    Returns:
        Distances; signed distance of the object to its cell's boundary [m]; smallest margin to a funnel and
        the axis; smallest margin to the slice and the axis; largest difference of wrenches.
    """
    wall, piece, between, pair = team_distances(links, vertices, pieces, pairs, walls, z)
    in_cell = signed_distance(cell, z[0], z[1])
    funnel, funnel_axis = _narrowest(z, funnel_lower, funnel_upper)
    room, slice_axis = _narrowest(z, lower, upper)
    error = largest_difference(measured, commanded)
    return wall, piece, between, pair, in_cell, funnel, funnel_axis, room, slice_axis, error


@compiled
def largest_difference(rows: FloatArray, others: FloatArray) -> float:
    """Largest component of a difference, no number if one of them is none.

    Args:
        rows: Shape (N, k).
        others: What they are compared with, shape (N, k), or (1, k) for the same with all.
    """
    largest = 0.0
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            difference = abs(rows[i, k] - others[i % others.shape[0], k])
            if np.isnan(difference):
                return np.nan
            largest = max(largest, difference)
    return largest


@compiled
def _poses(links: FloatArray, z: FloatArray) -> FloatArray:
    """Poses X_WC of all components as ``ComponentTree.poses`` has them, shape (C, 3)."""
    poses = np.empty((links.shape[0], 3))
    for i in range(links.shape[0]):
        parent = int(links[i, _PARENT])
        if parent < 0:
            poses[i, 0], poses[i, 1], poses[i, 2] = z[0], z[1], z[2]
            continue
        c, s, q = cos(poses[parent, 2]), sin(poses[parent, 2]), z[int(links[i, _VALUE])]
        x = poses[parent, 0] + c * links[i, _X] - s * links[i, _Y]
        y = poses[parent, 1] + s * links[i, _X] + c * links[i, _Y]
        angle = poses[parent, 2] + links[i, _ANGLE]
        c, s, dx, dy = cos(angle), sin(angle), links[i, _SLIDE_X] * q, links[i, _SLIDE_Y] * q
        poses[i, 0], poses[i, 1] = x + c * dx - s * dy, y + s * dx + c * dy
        poses[i, 2] = angle + links[i, _SIGN] * q
    return poses


@compiled
def _placed(vertices: FloatArray, poses: FloatArray) -> FloatArray:
    """Vertices in W, shape (v, 2) [m]."""
    placed = np.empty((vertices.shape[0], 2))
    for i in range(vertices.shape[0]):
        k, x, y = int(vertices[i, 0]), vertices[i, 1], vertices[i, 2]
        c, s = cos(poses[k, 2]), sin(poses[k, 2])
        placed[i, 0], placed[i, 1] = poses[k, 0] + c * x - s * y, poses[k, 1] + s * x + c * y
    return placed


@compiled
def _narrowest(z: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Smallest distance of an axis to its interval's ends, and the axis; the first that is no number."""
    least, axis = inf, 0
    for i in range(lower.size):
        margin = min(z[2 + i] - lower[i], upper[i] - z[2 + i])
        if np.isnan(z[2 + i] - lower[i]) or np.isnan(upper[i] - z[2 + i]):
            return np.nan, i
        if margin < least:
            least, axis = margin, i
    return least, axis
