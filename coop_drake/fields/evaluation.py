"""The map and its Jacobian at a point, in machine code: a series for what is far, panels for the rest."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.far_field import far_field, leaf_at
from coop_drake.fields.flat_map import FlatMap, centre_of, rounding_of, unflatten
from coop_drake.fields.layers import INSIDE, MapArrays
from coop_drake.fields.near_field import Sums, add, corner, is_at_vertex, regular, ring
from coop_drake.fields.quadrature import FloatArray
from coop_drake.fields.walls import is_inside, nearest_on_edges

__all__ = ["evaluate_at", "evaluate_many", "evaluate_one"]


@compiled(reassociate=True)
def _sums(m: MapArrays, leaf: int, x: float, y: float, tolerance: float) -> tuple[Sums, complex, int]:
    """Sum over the whole boundary; a step away from a junction of panels or 0; the vertex at hand or -1."""
    total, step, vertex = far_field(m, leaf, x, y), 0j, -1
    for item in range(m.near_start[leaf], m.near_start[leaf + 1]):
        k, place, level = m.near[item, 0], m.near[item, 1], m.near[item, 2]
        if k < 0:
            part, away = regular(m, place, x, y, tolerance)
        elif place < 0:
            part, away = corner(m, k, level, x, y, tolerance)
            vertex = k if is_at_vertex(m, k, x, y, tolerance) else vertex
        else:
            rx, ry = x - m.corners[k, 0], y - m.corners[k, 1]
            part, away = ring(m, k, level, place, x, y, rx, ry, tolerance)
        step = away if away != 0j else step
        total = add(total, part)
    return total, step, vertex


@compiled(reassociate=True)
def evaluate_one(m: MapArrays, x: float, y: float, tolerance: float) -> Sums:
    """u, v, u_x, u_y, v_x, v_y at a point relative to the map's centre; outside: at the nearest wall.

    Behind a wall by less than ``tolerance``, the rounding of the coordinates [m], counts as on it.
    """
    leaf = leaf_at(m, x, y)
    if m.leaf_state[leaf] != INSIDE and not is_inside(m.edges, x, y):
        x, y = nearest_on_edges(m.edges, x, y)
        leaf = leaf_at(m, x, y)
    total, step, vertex = _sums(m, leaf, x, y, tolerance)
    tu, tv, xu, yu, xv, yv = total
    if step != 0j:
        x, y = x + step.real, y + step.imag
        _, _, xu, yu, xv, yv = _sums(m, leaf_at(m, x, y), x, y, tolerance)[0]
    c = 0.5 / pi
    if vertex >= 0:  # a hair inside, T is as far away as that hair to the power of pi / angle
        return m.corners[vertex, 13], m.corners[vertex, 14], c * xu, c * yu, c * xv, c * yv
    return c * tu, c * tv, c * xu, c * yu, c * xv, c * yv


@compiled(reassociate=True)
def evaluate_at(flat: FlatMap, x: float, y: float) -> tuple[FloatArray, FloatArray]:
    """Image (2,) and Jacobian (2, 2) of a point of W."""
    centre = centre_of(flat)
    values = evaluate_one(unflatten(flat), x - centre[0], y - centre[1], rounding_of(flat))
    image, jacobian = np.empty(2), np.empty((2, 2))
    for k in range(2):
        image[k] = values[k]
        jacobian[0, k], jacobian[1, k] = values[2 + k], values[4 + k]
    return image, jacobian


@compiled(reassociate=True)
def evaluate_many(flat: FlatMap, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Images (n, 2) and Jacobians (n, 2, 2) of points (n, 2) relative to the map's centre."""
    m, rounding = unflatten(flat), rounding_of(flat)
    images, jacobians = np.empty((len(points), 2)), np.empty((len(points), 2, 2))
    for i in range(len(points)):
        values = evaluate_one(m, points[i, 0], points[i, 1], rounding)
        for k in range(2):
            images[i, k] = values[k]
            jacobians[i, 0, k], jacobians[i, 1, k] = values[2 + k], values[4 + k]
    return images, jacobians
