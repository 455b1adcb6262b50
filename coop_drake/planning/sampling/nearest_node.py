"""Nodes of a random tree, and a grid that finds the one nearest to a configuration; compiled."""

from __future__ import annotations

from math import floor, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = ["Tree", "add", "empty_tree", "nearest"]

_SQUARES, _TURNS = 600, 16
"""Squares of the grid in which nodes are found again, and parts of a full turn for each of them."""


class Tree(NamedTuple):
    """Nodes of a random tree, and a grid that finds the nodes near a position with about the same theta.

    Attributes:
        nodes: Configurations, shape (N, d).
        parents: Their parents, -1 for roots, shape (N,).
        filled: A bit for each part of a turn of each square: 1 if nodes are there, shape (S,).
        latest: The latest node in each square and part of a turn, where there are any, shape (S, T).
        before: For each node the one before it in its place, -1 if there is none, shape (N,).
        frame: Lower corner of the grid and the side of a square, shape (3,) [m].
        rows: Number of squares along y; squares are numbered along y first.
        circular: Which axes of configurations are circles, shape (d,).
    """

    nodes: FloatArray
    parents: IntArray
    filled: IntArray
    latest: IntArray
    before: IntArray
    frame: FloatArray
    rows: int
    circular: NDArray[np.bool_]


@compiled
def empty_tree(capacity: int, lower: FloatArray, upper: FloatArray, circular: NDArray[np.bool_]) -> Tree:
    """A tree without nodes, with memory for ``capacity`` of them, on a floor between two corners."""
    width, height = upper[0] - lower[0], upper[1] - lower[1]
    side = max(sqrt(width * height / _SQUARES), 1e-9)
    rows, columns = int(height / side) + 1, int(width / side) + 1
    return Tree(
        np.empty((capacity, len(lower))), np.full(capacity, -1), np.zeros(rows * columns, np.int64),
        np.empty((rows * columns, _TURNS), np.int64), np.full(capacity, -1),
        np.array([lower[0], lower[1], side]), rows, circular,
    )  # fmt: skip


@compiled
def _place_of(tree: Tree, z: FloatArray) -> tuple[int, int, float]:
    """Column and row of the square nearest to a position, and theta counted in parts of a turn."""
    columns = len(tree.latest) // tree.rows
    column = min(max(int((z[0] - tree.frame[0]) / tree.frame[2]), 0), columns - 1)
    row = min(max(int((z[1] - tree.frame[1]) / tree.frame[2]), 0), tree.rows - 1)
    turns = z[2] / (2.0 * pi)
    return column, row, (turns - floor(turns)) * _TURNS


@compiled
def add(tree: Tree, index: int, z: FloatArray, parent: int) -> None:
    """Store a node."""
    column, row, turned = _place_of(tree, z)
    square, part = column * tree.rows + row, int(turned) % _TURNS
    for k in range(len(z)):
        tree.nodes[index, k] = z[k]
    tree.parents[index] = parent
    if tree.filled[square] >> part & 1:
        tree.before[index] = tree.latest[square, part]
    tree.filled[square] |= 1 << part
    tree.latest[square, part] = index


@compiled
def _off(tree: Tree, place: int, last: int, axis: int, x: float) -> float:
    """Distance in one axis from a coordinate to a row or column of squares; outer ones go on outwards."""
    low = tree.frame[axis] + place * tree.frame[2]
    if x < low:
        return low - x if place > 0 else 0.0
    return max(x - low - tree.frame[2], 0.0) if place < last else 0.0


@compiled
def _nearest_in(
    tree: Tree, node: int, z: FloatArray, scale: FloatArray, best: float, index: int
) -> tuple[float, int]:
    """The nearest of the nodes of one place, given its latest one, and of the one known before."""
    while node >= 0:
        total = 0.0
        for k in range(len(z)):
            d = z[k] - tree.nodes[node, k]
            if tree.circular[k]:
                d -= 2.0 * pi * floor(d / (2.0 * pi) + 0.5)
            total += (d * scale[k]) ** 2
            if total >= best:
                break
        if total < best:
            best, index = total, node
        node = tree.before[node]
    return best, index


@compiled
def nearest(tree: Tree, z: FloatArray, scale: FloatArray) -> int:
    """Index of the node nearest to z; circular axes are periodic, theta (axis 2) among them.

    Squares are searched in growing rings, and in each of them the parts of a turn on both sides of theta.
    """
    best, index = np.inf, 0
    column, row, turned = _place_of(tree, z)
    columns, part = len(tree.latest) // tree.rows, int(turned)
    unit, turn = min(scale[0], scale[1]) * tree.frame[2], 2.0 * pi / _TURNS * scale[2]
    for ring in range(max(columns, tree.rows) + 1):
        if ring > 1 and best <= ((ring - 1) * unit) ** 2:
            break
        for i in range(max(column - ring, 0), min(column + ring + 1, columns)):
            step = 1 if abs(i - column) == ring else 2 * ring
            across = (_off(tree, i, columns - 1, 0, z[0]) * scale[0]) ** 2
            for j in range(row - ring, row + ring + 1, max(step, 1)):
                square = i * tree.rows + j
                if j < 0 or j >= tree.rows or tree.filled[square] == 0:
                    continue
                off = across + (_off(tree, j, tree.rows - 1, 1, z[1]) * scale[1]) ** 2
                for k in range(_TURNS // 2 + 1):
                    if off + (max(k - 1, 0) * turn) ** 2 >= best:
                        break
                    for side in range(1 if k == 0 or 2 * k == _TURNS else 2):
                        at = (part + k if side == 0 else part - k) % _TURNS
                        if tree.filled[square] >> at & 1:
                            node = tree.latest[square, at]
                            best, index = _nearest_in(tree, node, z, scale, best, index)
    return index
