"""A solved map as one array of numbers, and where its parts stand in it.

Compiled code takes about a microsecond for every array that Python hands to it, and its compile time grows
with the number of arrays that its functions pass on to each other. So a map crosses into compiled code as one
array.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray, IntArray

REFINED_NODES = 20
"""Gauss nodes on a panel after the density has been interpolated (`refinement`)."""
ORDER = 28
"""Terms of the power series of a leaf: with sources at 2.8 radii and more, the rest is below 1e-12."""
LEVELS = 44
"""Dyadic rings kept at each corner: they reach down to 6e-14 of its legs."""
ON_BOUNDARY, INSIDE, OUTSIDE = 0, 1, 2
"""State of a leaf of the quadtree: a wall may cross it, or it lies on one side of all walls."""

FlatMap = FloatArray
"""A map in one array of floats: the centre (x, y) and the rounding [m]; for every array of `MapArrays` where
it begins and its lengths along four axes, -1 for an axis that it does not have; then the arrays one after the
other. Integers are stored as floats, which hold them exactly."""

_HEAD = 3
"""Numbers before the table: centre and rounding."""
_ENTRY = 5
"""Numbers in the table for each array: its start and four lengths."""


class MapArrays(NamedTuple):
    """The arrays of a map, for the code that builds, tests and inspects maps.

    A source of the field is named by three integers (corner, place, level): (-1, k, 0) is regular panel k,
    (k, j, level) is panel j of a ring of corner k, and (k, -1, level) is all of corner k from a level down.

    Attributes:
        edges: Rows (x0, y0, x1, y1), shape (edges, 4) [m].
        sources: Rows x, y, dx, dy, mu_u, mu_v of the solved nodes, shape (6, n).
        corners: Rows (vertex, back, out, inward bisector as x y, leg, ends of the incoming and the outgoing
            leg as x y, image), shape (corners, 15). Panels share their ends with these to the last bit.
        corner_index: Rows (first source, panels of a ring on one leg, leg nodes n, first grid node, first
            ring break, first ring density, first tail), shape (corners + 1, 7).
        grid: Rows (distance, weight) of leg grids scaled to [0, 1], shape (., 2).
        breaks: Ring breakpoints scaled to [1/2, 1].
        densities: Values, then Legendre coefficients, of the density on every regular panel and then on every
            ring panel, shape (., 2, REFINED_NODES, 2).
        tails: Weight-corrected density of the legs at every level, shape (., 2).
        panels: Rows (start, end) as x y of regular panels, shape (panels, 4) [m].
        root: Centre and half side of the square that the quadtree divides, shape (3,) [m].
        boxes: For each box of the quadtree the first of its four quarters, or -1 - leaf, shape (boxes,).
        leaf_square: Centre and half diagonal of each leaf, shape (leaves, 3) [m].
        leaf_state: `ON_BOUNDARY`, `INSIDE` or `OUTSIDE`, shape (leaves,).
        local: Power series in units of the half diagonal of what is far from each leaf: rows of real and
            imaginary parts for u and for v, shape (leaves, ORDER, 4).
        near_start: First row of each leaf in ``near``, and the end, shape (leaves + 1,).
        near: Sources (corner, place, level) near each leaf, shape (., 3).
    """

    edges: FloatArray
    sources: FloatArray
    corners: FloatArray
    corner_index: IntArray
    grid: FloatArray
    breaks: FloatArray
    densities: FloatArray
    tails: FloatArray
    panels: FloatArray
    root: FloatArray
    boxes: IntArray
    leaf_square: FloatArray
    leaf_state: IntArray
    local: FloatArray
    near_start: IntArray
    near: IntArray


(EDGES, SOURCES, CORNERS, CORNER_INDEX, GRID, BREAKS, DENSITIES, TAILS, PANELS,
 ROOT, BOXES, LEAF_SQUARE, LEAF_STATE, LOCAL, NEAR_START, NEAR) = range(len(MapArrays._fields))  # fmt: skip

_INTEGERS = (CORNER_INDEX, BOXES, LEAF_STATE, NEAR_START, NEAR)


def flatten(arrays: MapArrays, centre: FloatArray, rounding: float) -> FlatMap:
    """Lay out a map in one array, with the origin of its coordinates in W, shape (2,) [m].

    ``rounding``: how far outside still counts as on the wall [m].
    """
    table = np.full((len(arrays), _ENTRY), -1.0)
    start = _HEAD + table.size
    for entry, array in zip(table, arrays, strict=True):
        entry[0] = start
        entry[1 : 1 + array.ndim] = array.shape
        start += array.size
    parts = (np.array([*centre, rounding]), table, *arrays)
    return np.concatenate([np.asarray(part, dtype=float).reshape(-1) for part in parts])


def unflatten(flat: FlatMap) -> MapArrays:
    """The map's arrays: views of the floats, copies of the integers."""
    table = flat[_HEAD : _HEAD + _ENTRY * len(MapArrays._fields)].reshape(-1, _ENTRY).astype(np.int64)
    arrays: list[np.ndarray] = []
    for k, (start, *lengths) in enumerate(table.tolist()):
        shape = [length for length in lengths if length >= 0]
        array = flat[start : start + int(np.prod(shape))].reshape(shape)
        arrays.append(array.astype(np.int64) if k in _INTEGERS else array)
    return MapArrays(*arrays)


@compiled(reassociate=True)
def centre_of(flat: FlatMap) -> tuple[float, float]:
    """Origin of the map's coordinates in W [m]."""
    return flat[0], flat[1]


@compiled(reassociate=True)
def rounding_of(flat: FlatMap) -> float:
    """How far outside still counts as on the wall [m]."""
    return float(flat[2])


@compiled(reassociate=True)
def row(flat: FlatMap, array: int, k: int, width: int) -> int:
    """Where row k of an array begins, whose rows hold ``width`` numbers."""
    return int(flat[_HEAD + array * _ENTRY]) + k * width


@compiled(reassociate=True)
def rows_of(flat: FlatMap, array: int) -> int:
    """How many rows an array has."""
    return int(flat[_HEAD + array * _ENTRY + 1])


@compiled(reassociate=True)
def integer(flat: FlatMap, array: int, k: int, width: int, column: int) -> int:
    """The integer in row k and a column of an array whose rows hold ``width`` numbers."""
    return int(flat[row(flat, array, k, width) + column])
