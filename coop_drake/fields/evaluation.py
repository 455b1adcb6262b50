"""The map and its Jacobian at a point, in compiled code: a series for what is far, panels for the rest."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.far_field import far_field, leaf_at
from coop_drake.fields.flat_map import (
    CORNERS,
    EDGES,
    INSIDE,
    LEAF_STATE,
    NEAR,
    NEAR_START,
    FlatMap,
    integer,
    rounding_of,
    row,
    rows_of,
)
from coop_drake.fields.near_field import Sums, add, corner_sums, is_at_vertex, panel_sums
from coop_drake.fields.walls import is_inside, nearest_on_walls
from coop_drake.tree.pose import FloatArray


@compiled(reassociate=True)
def _all_sums(m: FlatMap, x: float, y: float) -> tuple[Sums, int]:
    """Sums over the whole boundary at a point of the square; and the vertex that it counts as, or -1."""
    leaf, vertex, rounding = leaf_at(m, x, y), -1, rounding_of(m)
    total = far_field(m, leaf, x, y)
    for item in range(integer(m, NEAR_START, leaf, 1, 0), integer(m, NEAR_START, leaf + 1, 1, 0)):
        k, place, level = (
            integer(m, NEAR, item, 3, 0),
            integer(m, NEAR, item, 3, 1),
            integer(m, NEAR, item, 3, 2),
        )
        if place < 0:
            part = corner_sums(m, k, level, x, y, rounding)
            vertex = k if is_at_vertex(m, k, x, y, rounding) else vertex
        else:
            corner = row(m, CORNERS, max(k, 0), 15)
            part = panel_sums(m, k, place, level, x, y, x - m[corner], y - m[corner + 1], rounding)
        total = add(total, part)
    return total, vertex


@compiled(reassociate=True)
def evaluate_one(m: FlatMap, x: float, y: float) -> tuple[float, float, float, float, float, float]:
    """u, v, u_x, u_y, v_x, v_y at a point relative to the map's centre [-, 1/m].

    A point outside has the values of the nearest point of the walls.
    A point that is behind a wall by less than the map's rounding counts as on the wall. At a vertex T is that
    of the vertex and J that of a point just inside; where two panels meet, J is that of a point just off the
    wall.
    """
    edges, count = row(m, EDGES, 0, 4), rows_of(m, EDGES)
    if integer(m, LEAF_STATE, leaf_at(m, x, y), 1, 0) != INSIDE and not is_inside(m, edges, count, x, y):
        x, y = nearest_on_walls(m, edges, count, x, y)
    (tu, tv, xu, yu, xv, yv, step_x, step_y), vertex = _all_sums(m, x, y)
    if step_x != 0.0 or step_y != 0.0:
        (_, _, xu, yu, xv, yv, _, _), _ = _all_sums(m, x + step_x, y + step_y)
    c = 0.5 / pi
    if vertex >= 0:
        image = row(m, CORNERS, vertex, 15) + 13
        return m[image], m[image + 1], c * xu, c * yu, c * xv, c * yv
    return c * tu, c * tv, c * xu, c * yu, c * xv, c * yv


@compiled(reassociate=True)
def evaluate_many(m: FlatMap, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Images (n, 2) [-] and Jacobians (n, 2, 2) [1/m] of points (n, 2) relative to the map's centre [m]."""
    images, jacobians = np.empty((len(points), 2)), np.empty((len(points), 2, 2))
    for i in range(len(points)):
        values = evaluate_one(m, points[i, 0], points[i, 1])
        for k in range(2):
            images[i, k] = values[k]
            jacobians[i, 0, k], jacobians[i, 1, k] = values[2 + k], values[4 + k]
    return images, jacobians
