"""Compiled bidirectional random trees: a source of candidate paths, never of proofs."""

from __future__ import annotations

from math import floor, pi, sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.sweep_kernels import IntArray
from coop_drake.planning.sampling.collision_kernels import is_free, segment_is_free
from coop_drake.planning.sampling.obstacle_grid import Walls
from coop_drake.planning.sampling.team_arrays import TeamArrays
from coop_drake.tree.pose import FloatArray

_SQUARES = 2_500
_GUIDED = 0.85
_LEAST_SPREAD = 0.1


class _Tree(NamedTuple):
    """Nodes of a random tree, found again by the square of a grid that their position lies in.

    Attributes:
        nodes: Configurations, shape (N, d).
        parents: Their parents, -1 for roots, shape (N,).
        latest: The latest node in each square, -1 if there is none, squares along y first, shape (S,).
        before: For each node the one before it in its square, -1 if there is none, shape (N,).
        frame: Lower corner of the grid and the side of a square, shape (3,) [m].
        rows: Number of squares along y.
    """

    nodes: FloatArray
    parents: IntArray
    latest: IntArray
    before: IntArray
    frame: FloatArray
    rows: int


@compiled
def _empty_tree(room: int, lower: FloatArray, upper: FloatArray) -> _Tree:
    """A tree without nodes on a floor between two corners."""
    width, height = upper[0] - lower[0], upper[1] - lower[1]
    side = max(sqrt(width * height / _SQUARES), 1e-9)
    rows, columns = int(height / side) + 1, int(width / side) + 1
    return _Tree(
        np.empty((room, len(lower))),
        np.full(room, -1),
        np.full(rows * columns, -1),
        np.full(room, -1),
        np.array([lower[0], lower[1], side]),
        rows,
    )


@compiled
def _place_of(tree: _Tree, z: FloatArray) -> tuple[int, int]:
    """Column and row of the square that a configuration's position lies in, or of the nearest one."""
    columns = len(tree.latest) // tree.rows
    column = min(max(int((z[0] - tree.frame[0]) / tree.frame[2]), 0), columns - 1)
    row = min(max(int((z[1] - tree.frame[1]) / tree.frame[2]), 0), tree.rows - 1)
    return column, row


@compiled
def _add(tree: _Tree, index: int, z: FloatArray, parent: int) -> None:
    """Store a node."""
    column, row = _place_of(tree, z)
    square = column * tree.rows + row
    tree.nodes[index] = z
    tree.parents[index] = parent
    tree.before[index] = tree.latest[square]
    tree.latest[square] = index


@compiled
def _nearest(tree: _Tree, z: FloatArray, scale: FloatArray) -> int:
    """Index of the node nearest to z; theta (axis 2) is periodic. Squares are searched in growing rings."""
    best, index = np.inf, 0
    column, row = _place_of(tree, z)
    columns = len(tree.latest) // tree.rows
    unit = min(scale[0], scale[1]) * tree.frame[2]
    for ring in range(max(columns, tree.rows) + 1):
        if ring > 1 and best <= ((ring - 1) * unit) ** 2:
            break
        for i in range(max(column - ring, 0), min(column + ring + 1, columns)):
            step = 1 if abs(i - column) == ring else 2 * ring
            for j in range(row - ring, row + ring + 1, max(step, 1)):
                node = tree.latest[i * tree.rows + j] if 0 <= j < tree.rows else -1
                while node >= 0:
                    total = 0.0
                    for k in range(len(z)):
                        d = z[k] - tree.nodes[node, k]
                        if k == 2:
                            d -= 2.0 * pi * floor(d / (2.0 * pi) + 0.5)
                        total += (d * scale[k]) ** 2
                        if total >= best:
                            break
                    if total < best:
                        best, index = total, node
                    node = tree.before[node]
    return index


@compiled
def _grow(
    team: TeamArrays,
    walls: Walls,
    tree: _Tree,
    count: int,
    z: FloatArray,
    reach: float,
    gap: float,
    scale: FloatArray,
    step: float,
) -> tuple[int, bool]:
    """Add a node on the way from the nearest one to z; returns the new count and whether z was reached."""
    near = _nearest(tree, z, scale)
    turn = z - tree.nodes[near]
    turn[2] -= 2.0 * pi * floor(turn[2] / (2.0 * pi) + 0.5)
    length = np.sqrt(((turn * scale) ** 2).sum())
    share = 1.0 if length <= reach else reach / length
    passed = segment_is_free(team, walls, tree.nodes[near], tree.nodes[near] + share * turn, gap, scale, step)
    if passed * share * length < 0.5 * step and passed < 1.0:
        return count, False
    _add(tree, count, tree.nodes[near] + passed * share * turn, near)
    return count + 1, passed == 1.0 and share == 1.0


@compiled
def _draw(
    u: FloatArray, guide: FloatArray, spread: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """One sample: around the guide for most of the draws, uniform otherwise and on axes without spread.

    Some keep closer to the guide than others: what is narrow for the guide is narrower for what it guides.
    """
    z = lower + u[2:] * (upper - lower)
    if len(guide) > 0 and u[0] < _GUIDED:
        at = guide[min(len(guide) - 1, int(u[1] * len(guide)))]
        share = _LEAST_SPREAD + (1.0 - _LEAST_SPREAD) * u[0] / _GUIDED
        for k in range(len(z)):
            if spread[k] > 0.0:
                z[k] = at[k] + (2.0 * u[2 + k] - 1.0) * share * spread[k]
                if k > 2:
                    z[k] = min(upper[k], max(lower[k], z[k]))
    return z


@compiled
def connect(
    team: TeamArrays,
    walls: Walls,
    start: FloatArray,
    roots: FloatArray,
    guide: FloatArray,
    spread: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    scale: FloatArray,
    gap: float,
    step: float,
    uniforms: FloatArray,
) -> tuple[FloatArray, int]:
    """Grow one tree from the start and one from the goals towards samples and towards each other.

    Args:
        team: The team.
        walls: The floor.
        start: Free configuration, shape (d,).
        roots: Free goal configurations, shape (R, d).
        guide: Configurations to sample around, shape (G, d); may be empty.
        spread: How far around, per axis; 0 for axes that the guide does not know, shape (d,).
        lower: Lower ends of the box sampled uniformly, shape (d,).
        upper: Upper ends, shape (d,).
        scale: How far a unit of each axis moves the team, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        step: Distance between checks [m].
        uniforms: Random numbers in [0, 1), one row for each sample, shape (S, 2 + d).

    Returns:
        Path from start to a goal, theta unwrapped, shape (m, d), without rows if none was found; and the
        number of samples drawn.
    """
    room = 2 * len(uniforms) + len(roots) + 1
    trees = (_empty_tree(room, lower, upper), _empty_tree(room, lower, upper))
    _add(trees[0], 0, start, -1)
    for k in range(len(roots)):
        _add(trees[1], k, roots[k], -1)
    counts = np.array([1, len(roots)])
    side = 0
    for row in range(len(uniforms)):
        z = _draw(uniforms[row], guide, spread, lower, upper)
        other = 1 - side
        before = counts[side]
        counts[side], _ = _grow(team, walls, trees[side], before, z, 40.0 * step, gap, scale, step)
        if counts[side] > before:
            z = trees[side].nodes[before].copy()
            counts[other], met = _grow(team, walls, trees[other], counts[other], z, np.inf, gap, scale, step)
            if met:
                return _join(trees[0], trees[1], counts), row + 1
        side = other
    return np.empty((0, len(start))), len(uniforms)


@compiled
def shortened(
    team: TeamArrays,
    walls: Walls,
    path: FloatArray,
    scale: FloatArray,
    gap: float,
    step: float,
    uniforms: FloatArray,
) -> FloatArray:
    """Straighten a path between random samples of it: all axes together, theta or one joint alone.

    Args:
        team: The team.
        walls: The floor.
        path: Free samples, close together, shape (m, d).
        scale: How far a unit of each axis moves the team, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        step: Distance between checks [m].
        uniforms: Random numbers in [0, 1), one row for each attempt, shape (k, 3).
    """
    path = path.copy()
    count, size = path.shape
    for row in range(len(uniforms)):
        a, b = int(uniforms[row, 0] * count), int(uniforms[row, 1] * count)
        i, j = min(a, b), max(a, b)
        if j - i < 2:
            continue
        part = path[i : j + 1].copy()
        only = 2 + int(uniforms[row, 2] * (size - 2))
        for k in range(1, j - i):
            share = k / (j - i)
            for axis in range(size):
                if row % 3 == 0 or axis == only:
                    part[k, axis] = path[i, axis] + share * (path[j, axis] - path[i, axis])
        free = True
        stride = 8
        while free and stride > 0:
            for k in range(stride, j - i, 2 * stride if stride < 8 else stride):
                if not is_free(team, walls, part[k], gap):
                    free = False
                    break
            stride //= 2
        k = 0
        while free and k < j - i:
            free = segment_is_free(team, walls, part[k], part[k + 1], gap, scale, step) == 1.0
            k += 1
        if free:
            path[i : j + 1] = part
    return path


@compiled
def _join(first: _Tree, last: _Tree, counts: IntArray) -> FloatArray:
    """Path through the newest nodes of both trees, which stand for one configuration."""
    chain = np.empty((counts[0] + counts[1], first.nodes.shape[1]))
    size = 0
    i = counts[0] - 1
    while i >= 0:
        chain[size] = first.nodes[i]
        size += 1
        i = first.parents[i]
    chain[:size] = chain[:size][::-1].copy()
    i = last.parents[counts[1] - 1]
    while i >= 0:
        turn = last.nodes[i, 2] - chain[size - 1, 2]
        chain[size] = last.nodes[i]
        chain[size, 2] = chain[size - 1, 2] + turn - 2.0 * pi * floor(turn / (2.0 * pi) + 0.5)
        size += 1
        i = last.parents[i]
    return chain[:size].copy()
