"""Compiled bidirectional random trees and what they grow to: a source of candidate paths, never of proofs."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.planning.sampling.collision import (
    ObstacleGrid,
    bodies_apart,
    is_free_placed,
    segment_is_free,
    team_clearance,
)
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import TeamArrays, place_component

# Nodes of a random tree, and a grid that finds the one nearest to a configuration; compiled.

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


@compiled(borrows=True)
def _place_of(tree: Tree, z: FloatArray) -> tuple[int, int, float]:
    """Column and row of the square nearest to a position, and theta counted in parts of a turn."""
    columns = len(tree.latest) // tree.rows
    column = min(max(int((z[0] - tree.frame[0]) / tree.frame[2]), 0), columns - 1)
    row = min(max(int((z[1] - tree.frame[1]) / tree.frame[2]), 0), tree.rows - 1)
    turns = z[2] / (2.0 * pi)
    return column, row, (turns - floor(turns)) * _TURNS


@compiled(borrows=True)
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


@compiled(borrows=True)
def _off(tree: Tree, place: int, last: int, axis: int, x: float) -> float:
    """Distance in one axis from a coordinate to a row or column of squares; outer ones go on outwards."""
    low = tree.frame[axis] + place * tree.frame[2]
    if x < low:
        return low - x if place > 0 else 0.0
    return max(x - low - tree.frame[2], 0.0) if place < last else 0.0


@compiled(borrows=True)
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


@compiled(borrows=True)
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


# Compiled samples around a guide path: along it or where trees have come far, component by component.

_GUIDED = 0.85
"""Fraction of the samples that are drawn around the guiding path [-]; the others are uniform."""

_LEAST_SPREAD = 0.1
"""Smallest fraction of the spread that a guided sample uses [-]: some samples stay close to the guide."""

_EVERYWHERE = 0.2
"""Fraction of the samples around a guide that is followed that are drawn along all of it [-]."""

_WINDOW = 20
"""The others are drawn up to so many rows before and after the furthest row: two metres of way."""

_AT_ROW = 0.5
"""A tree has reached a row of the guide when it has a node this near to it [m]."""

_STEPS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703, 0.6180339887498949)
"""Steps between the values that are tried of x, y, theta and a joint, as fractions of their ranges [-]: 1/g,
1/g^2 and 1/g^3 with g^4 = g + 1, whose multiples fill a cube evenly, and 1/g with g^2 = g + 1 for an
interval."""


@dataclass(frozen=True)
class GuidePath:
    """A path of a smaller subsystem, around which a larger subsystem is sampled.

    Attributes:
        path: Configurations, shape (m, 3 + k).
        joints: For each of its joints the index of that joint in the whole q.
        has_theta: Whether its theta is to be followed; False for a disc, whose angle has no meaning.
    """

    path: FloatArray
    joints: tuple[int, ...]
    has_theta: bool = True


class SampledRegion(NamedTuple):
    """What is sampled: a box, and in it mostly the surroundings of a guide path.

    Attributes:
        guide: Configurations to sample around, shape (G, d); may be empty.
        spread: How far around, for each axis; 0 for axes that the guide does not know, shape (d,) [m, rad].
        lower: Lower ends of the box that is sampled uniformly, shape (d,) [m, rad].
        upper: Upper ends, shape (d,).
        circular: Which axes are circles: guided samples may lie beyond these ends there, shape (d,).
        long: A guide with more rows than this [-] is followed: most samples are drawn where a tree has come
            furthest, because those far from both trees are of little use.
        tries: Values that are tried for the axes of a component until it is free [-]; with one try samples
            are not looked at.
    """

    guide: FloatArray
    spread: FloatArray
    lower: FloatArray
    upper: FloatArray
    circular: NDArray[np.bool_]
    long: int
    tries: int


@compiled(inlined=True, borrows=True)
def _value(region: SampledRegion, u: FloatArray, at: int, k: int, number: float) -> float:
    """Value of an axis for a random number: around the guide, or anywhere on axes without spread.

    Some samples keep closer to the guide than others: what is narrow for the guide is narrower for what it
    guides.
    """
    lower, upper, spread = region.lower[k], region.upper[k], region.spread[k]
    if len(region.guide) == 0 or u[0] >= _GUIDED or spread == 0.0:
        return float(lower + number * (upper - lower))
    fraction = _LEAST_SPREAD + (1.0 - _LEAST_SPREAD) * u[0] / _GUIDED
    value = region.guide[at, k] + (2.0 * number - 1.0) * fraction * spread
    return float(value if k < 2 or region.circular[k] else min(upper, max(lower, value)))


@compiled(borrows=True)
def draw(
    team: TeamArrays, grid: ObstacleGrid, region: SampledRegion, u: FloatArray, at: int, gap: float,
    z: FloatArray, poses: FloatArray,
) -> None:  # fmt: skip
    """Draw one sample whose components, from the object outwards, get other values until they are free.

    Few samples of a large team are free otherwise.

    Args:
        team: The team.
        grid: The floor.
        region: What is sampled.
        u: Random numbers in [0, 1), shape (2 + d,).
        at: Row of the guide to sample around.
        gap: Distance that pairs of bodies must keep [m].
        z: Receives the configuration, which need not be free, shape (d,) [m, rad].
        poses: Room for the poses of all components, shape (C, 5).
    """
    for k in range(len(z)):
        z[k] = _value(region, u, at, k, u[2 + k])
    for component in range(len(team.links) if region.tries > 1 else 0):
        for number in range(1, region.tries + 1):
            place_component(team, z, component, poses)
            if number == region.tries or (
                team_clearance(team, grid, poses, 0.0, component) >= 0.0
                and bodies_apart(team, poses, gap, component)
            ):
                break
            posed = team.links[component, 0] < 0
            first, last = (0, 3) if posed else (team.links[component, 1], team.links[component, 1] + 1)
            for k in range(first, last):
                step = _STEPS[k if posed else 3]
                z[k] = _value(region, u, at, k, (u[2 + k] + number * step) % 1.0)


# Compiled bidirectional random trees: a source of candidate paths, never of proofs.


@compiled(borrows=True)
def _grow(
    team: TeamArrays,
    grid: ObstacleGrid,
    tree: Tree,
    count: int,
    z: FloatArray,
    reach: float,
    gap: float,
    scale: FloatArray,
    step: float,
    room: FloatArray,
    poses: FloatArray,
) -> tuple[int, bool]:
    """Add a node between the nearest one and z; returns the new number of nodes and whether z was reached.

    There is room for configurations in ``room``, shape (3, d), and for poses in ``poses``, shape (C, 5).
    """
    near = nearest(tree, z, scale)
    length = 0.0
    move, aim = room[0], room[1]
    for k in range(len(z)):
        move[k] = z[k] - tree.nodes[near, k]
        if tree.circular[k]:
            move[k] -= 2.0 * pi * floor(move[k] / (2.0 * pi) + 0.5)
        length += (move[k] * scale[k]) ** 2
    length = sqrt(length)
    fraction = 1.0 if length <= reach else reach / length
    for k in range(len(z)):
        aim[k] = tree.nodes[near, k] + fraction * move[k]
    passed = segment_is_free(team, grid, tree.nodes[near], aim, gap, scale, step, room[2], poses)
    if passed * fraction * length < 0.5 * step and passed < 1.0:
        return count, False
    for k in range(len(z)):
        aim[k] = tree.nodes[near, k] + passed * fraction * move[k]
    add(tree, count, aim, near)
    return count + 1, passed == 1.0 and fraction == 1.0


@compiled
def connect(
    team: TeamArrays,
    grid: ObstacleGrid,
    trees: tuple[Tree, Tree],
    start: FloatArray,
    roots: FloatArray,
    region: SampledRegion,
    scale: FloatArray,
    gap: float,
    step: float,
    uniforms: FloatArray,
) -> tuple[int, int, int]:
    """Grow one tree from the start and one from the goals towards samples and towards each other.

    Args:
        team: The team.
        grid: The floor.
        trees: Two empty trees with memory for 2 S + R + 1 nodes each; receive the nodes.
        start: Free configuration, shape (d,).
        roots: Free goal configurations, shape (R, d).
        region: What is sampled.
        scale: How far a unit of each axis moves the team, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        step: Distance between checks [m].
        uniforms: Random numbers in [0, 1), one row for each sample, shape (S, 2 + d).

    Returns:
        Numbers of nodes of both trees, whose newest ones stand for one configuration, or zeros if the trees
        have not met; and the number of samples drawn.
    """
    counts = np.array([1, len(roots)])
    for side in range(2):
        for k in range(counts[side]):
            add(trees[side], k, start if side == 0 else roots[k], -1)
    room, poses, drawn = np.empty((3, len(start))), np.empty((len(team.links), 5)), np.empty(len(start))
    side, fronts = 0, np.array([0, len(region.guide) - 1])
    for row in range(len(uniforms)):
        # The row of the guide to sample around: any, or mostly one near the furthest that the tree reached.
        number, rows = uniforms[row, 1], len(region.guide)
        if rows <= region.long:
            at = min(rows - 1, int(number * rows))
        elif number < _EVERYWHERE:
            at = int(number / _EVERYWHERE * rows)
        else:
            first, last = max(0, fronts[side] - _WINDOW), min(rows, fronts[side] + _WINDOW + 1)
            at = first + int((number - _EVERYWHERE) / (1.0 - _EVERYWHERE) * (last - first))
        draw(team, grid, region, uniforms[row], at, gap, drawn, poses)
        other = 1 - side
        before = counts[side]
        counts[side], _ = _grow(
            team, grid, trees[side], before, drawn, 40.0 * step, gap, scale, step, room, poses
        )
        if counts[side] > before:
            z = trees[side].nodes[before]
            reached = fronts[side]
            for _ in range(2 * _WINDOW if rows > region.long else 0):
                reached += 1 - 2 * side
                if reached < 0 or reached >= rows:
                    break
                away = (z[0] - region.guide[reached, 0]) ** 2 + (z[1] - region.guide[reached, 1]) ** 2
                if away < _AT_ROW * _AT_ROW:
                    fronts[side] = reached
            counts[other], met = _grow(
                team, grid, trees[other], counts[other], z, np.inf, gap, scale, step, room, poses
            )
            if met:
                return counts[0], counts[1], row + 1
        side = other
    return 0, 0, len(uniforms)


def joined(first: Tree, last: Tree) -> FloatArray:
    """Return the path through the last nodes of both trees, which stand for one configuration.

    Args:
        first: The nodes of the tree that begins at the start.
        last: Those of the other one.

    Returns:
        From the start to a goal, circular axes unwrapped, shape (m, d).
    """
    way = [len(first.nodes) - 1]
    while first.parents[way[-1]] >= 0:
        way.append(int(first.parents[way[-1]]))
    path, i = [*first.nodes[way[::-1]]], int(last.parents[len(last.nodes) - 1])
    while i >= 0:
        turn = last.nodes[i] - path[-1]
        unwrapped = path[-1] + turn - 2.0 * pi * np.floor(turn / (2.0 * pi) + 0.5)
        path.append(np.where(first.circular, unwrapped, last.nodes[i]))
        i = int(last.parents[i])
    return np.array(path)


@compiled
def shortened(
    team: TeamArrays,
    grid: ObstacleGrid,
    path: FloatArray,
    scale: FloatArray,
    gap: float,
    step: float,
    uniforms: FloatArray,
) -> FloatArray:
    """Straighten a path between random samples of it: all axes together, theta or one joint alone.

    Args:
        team: The team.
        grid: The floor.
        path: Free samples, close together, shape (m, d).
        scale: How far a unit of each axis moves the team, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        step: Distance between checks [m].
        uniforms: Random numbers in [0, 1), one row for each attempt, shape (k, 3).
    """
    path, part = path.copy(), np.empty(path.shape)
    count, size = path.shape
    z, poses = np.empty(size), np.empty((len(team.links), 5))
    for row in range(len(uniforms)):
        a, b = int(uniforms[row, 0] * count), int(uniforms[row, 1] * count)
        i, j = min(a, b), max(a, b)
        if j - i < 2:
            continue
        only = 2 + int(uniforms[row, 2] * (size - 2))
        for k in range(j - i + 1):
            for axis in range(size):
                part[k, axis] = path[i + k, axis]
                if 0 < k < j - i and (row % 3 == 0 or axis == only):
                    part[k, axis] = path[i, axis] + k / (j - i) * (path[j, axis] - path[i, axis])
        free = True
        stride = 8
        while free and stride > 0:
            for k in range(stride, j - i, 2 * stride if stride < 8 else stride):
                if not is_free_placed(team, grid, part[k], gap, poses):
                    free = False
                    break
            stride //= 2
        k = 0
        while free and k < j - i:
            free = segment_is_free(team, grid, part[k], part[k + 1], gap, scale, step, z, poses) == 1.0
            k += 1
        for k in range(j - i if free else 0):
            for axis in range(size):
                path[i + k, axis] = part[k, axis]
    return path
