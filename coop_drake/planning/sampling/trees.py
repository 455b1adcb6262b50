"""Compiled bidirectional random trees: a source of candidate paths, never of proofs."""

from __future__ import annotations

from math import floor, pi, sqrt

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.planning.sampling.collision_kernels import is_free, segment_is_free
from coop_drake.planning.sampling.guided_samples import SampledRegion, draw, furthest_row, guide_row
from coop_drake.planning.sampling.nearest_node import Tree, add, empty_tree, nearest
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays


@compiled
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
) -> tuple[int, bool]:
    """Add a node between the nearest one and z; returns the new number of nodes and whether z was reached."""
    near = nearest(tree, z, scale)
    length = 0.0
    move, aim = np.empty(len(z)), np.empty(len(z))
    for k in range(len(z)):
        move[k] = z[k] - tree.nodes[near, k]
        if tree.circular[k]:
            move[k] -= 2.0 * pi * floor(move[k] / (2.0 * pi) + 0.5)
        length += (move[k] * scale[k]) ** 2
    length = sqrt(length)
    fraction = 1.0 if length <= reach else reach / length
    for k in range(len(z)):
        aim[k] = tree.nodes[near, k] + fraction * move[k]
    passed = segment_is_free(team, grid, tree.nodes[near], aim, gap, scale, step)
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
    start: FloatArray,
    roots: FloatArray,
    region: SampledRegion,
    scale: FloatArray,
    gap: float,
    step: float,
    uniforms: FloatArray,
) -> tuple[FloatArray, int]:
    """Grow one tree from the start and one from the goals towards samples and towards each other.

    Args:
        team: The team.
        grid: The floor.
        start: Free configuration, shape (d,).
        roots: Free goal configurations, shape (R, d).
        region: What is sampled.
        scale: How far a unit of each axis moves the team, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        step: Distance between checks [m].
        uniforms: Random numbers in [0, 1), one row for each sample, shape (S, 2 + d).

    Returns:
        Path from start to a goal, circular axes unwrapped, shape (m, d), without rows if none was found; and
        the number of samples drawn.
    """
    capacity = 2 * len(uniforms) + len(roots) + 1
    lower, upper = region.lower, region.upper
    circular = region.circular
    trees = (empty_tree(capacity, lower, upper, circular), empty_tree(capacity, lower, upper, circular))
    counts = np.array([1, len(roots)])
    for side in range(2):
        for k in range(counts[side]):
            add(trees[side], k, start if side == 0 else roots[k], -1)
    side, fronts = 0, np.array([0, len(region.guide) - 1])
    for row in range(len(uniforms)):
        at = guide_row(region, uniforms[row, 1], fronts[side])
        z = draw(team, grid, region, uniforms[row], at, gap)
        other = 1 - side
        before = counts[side]
        counts[side], _ = _grow(team, grid, trees[side], before, z, 40.0 * step, gap, scale, step)
        if counts[side] > before:
            z = trees[side].nodes[before]
            fronts[side] = furthest_row(region, fronts[side], side, z)
            counts[other], met = _grow(team, grid, trees[other], counts[other], z, np.inf, gap, scale, step)
            if met:
                return _join(trees[0], trees[1], counts), row + 1
        side = other
    return np.empty((0, len(start))), len(uniforms)


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
                if not is_free(team, grid, part[k], gap):
                    free = False
                    break
            stride //= 2
        k = 0
        while free and k < j - i:
            free = segment_is_free(team, grid, part[k], part[k + 1], gap, scale, step) == 1.0
            k += 1
        for k in range(j - i if free else 0):
            for axis in range(size):
                path[i + k, axis] = part[k, axis]
    return path


@compiled
def _join(first: Tree, last: Tree, counts: IntArray) -> FloatArray:
    """Path through the newest nodes of both trees, which stand for one configuration."""
    path = np.empty((counts[0] + counts[1], first.nodes.shape[1]))
    size = 0
    i = counts[0] - 1
    while i >= 0:
        size, i = size + 1, first.parents[i]
    at, i = size, counts[0] - 1
    while i >= 0:
        at -= 1
        for k in range(path.shape[1]):
            path[at, k] = first.nodes[i, k]
        i = first.parents[i]
    i = last.parents[counts[1] - 1]
    while i >= 0:
        for k in range(path.shape[1]):
            path[size, k] = last.nodes[i, k]
        for k in range(path.shape[1]):
            if first.circular[k]:
                turn = last.nodes[i, k] - path[size - 1, k]
                path[size, k] = path[size - 1, k] + turn - 2.0 * pi * floor(turn / (2.0 * pi) + 0.5)
        size, i = size + 1, last.parents[i]
    return path[:size]
