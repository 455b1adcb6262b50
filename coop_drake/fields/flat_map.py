"""A map as one flat array: numba takes a microsecond for every array that compiled code is handed."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.layers import MapArrays
from coop_drake.fields.quadrature import FloatArray

__all__ = ["FlatMap", "centre_of", "flatten", "rounding_of", "unflatten"]

FlatMap = np.ndarray
"""Words of 64 bits: the centre, the rounding, where every array of `MapArrays` begins and its shape, and the
arrays one after the other, int64 as they are and float64 bit by bit; shape (words,), int64."""

_HEAD = 3
_ENTRY = 6  # of an array's row in the table: start, words, four lengths


def flatten(arrays: MapArrays, centre: FloatArray, rounding: float) -> FlatMap:
    """Lay out a map in one array.

    Args:
        arrays: The map.
        centre: Origin of its coordinates in W [m], shape (2,).
        rounding: How far outside still counts as on the wall [m].
    """
    table = np.zeros((len(arrays), _ENTRY), dtype=np.int64)
    start = _HEAD + table.size
    for row, array in zip(table, arrays, strict=True):
        row[:2] = start, array.size
        row[2 : 2 + array.ndim] = array.shape
        start += array.size
    parts = (np.array([*centre, rounding]), table, *arrays)
    return np.concatenate([np.ascontiguousarray(part).reshape(-1).view(np.int64) for part in parts])


@compiled(reassociate=True)
def centre_of(flat: FlatMap) -> FloatArray:
    """Origin of the map's coordinates in W [m], shape (2,)."""
    centre: FloatArray = flat[:2].view(np.float64)
    return centre


@compiled(reassociate=True)
def rounding_of(flat: FlatMap) -> float:
    """How far outside still counts as on the wall [m]."""
    return float(flat[2:3].view(np.float64)[0])


@compiled(reassociate=True)
def _words(flat: FlatMap, k: int) -> FlatMap:
    """Words of the array that stands at a place of `MapArrays`."""
    start = flat[_HEAD + k * _ENTRY]
    return flat[start : start + flat[_HEAD + k * _ENTRY + 1]]


@compiled(reassociate=True)
def _length(flat: FlatMap, k: int, axis: int) -> int:
    """Its length along an axis."""
    return int(flat[_HEAD + k * _ENTRY + 2 + axis])


@compiled(reassociate=True)
def _floats(flat: FlatMap, k: int) -> FloatArray:
    """One of floats, flat."""
    floats: FloatArray = _words(flat, k).view(np.float64)
    return floats


@compiled(reassociate=True)
def _rows(flat: FlatMap, k: int) -> FloatArray:
    """One of floats with two axes."""
    return _floats(flat, k).reshape((_length(flat, k, 0), _length(flat, k, 1)))


@compiled(reassociate=True)
def _blocks(flat: FlatMap, k: int) -> FloatArray:
    """One of floats with four axes."""
    n0, n1, n2, n3 = _length(flat, k, 0), _length(flat, k, 1), _length(flat, k, 2), _length(flat, k, 3)
    return _floats(flat, k).reshape((n0, n1, n2, n3))


@compiled(reassociate=True)
def unflatten(flat: FlatMap) -> MapArrays:
    """The map's arrays, as views; their places are those of `MapArrays`."""
    return MapArrays(
        _rows(flat, 0),  # edges
        _rows(flat, 1),  # sources
        _rows(flat, 2),  # corners
        _words(flat, 3).reshape((_length(flat, 3, 0), _length(flat, 3, 1))),  # corner_index
        _rows(flat, 4),  # grid
        _floats(flat, 5),  # breaks
        _blocks(flat, 6),  # rings
        _rows(flat, 7),  # tails
        _rows(flat, 8),  # panels
        _blocks(flat, 9),  # panel_density
        _floats(flat, 10),  # root
        _words(flat, 11),  # box_child
        _words(flat, 12),  # box_leaf
        _rows(flat, 13),  # leaf_square
        _words(flat, 14),  # leaf_state
        _floats(flat, 15).reshape(
            (_length(flat, 15, 0), _length(flat, 15, 1), _length(flat, 15, 2))
        ),  # local
        _words(flat, 16),  # near_start
        _words(flat, 17).reshape((_length(flat, 17, 0), _length(flat, 17, 1))),  # near
    )
