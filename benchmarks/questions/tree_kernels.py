"""RRT-Connect as in the textbooks, compiled: two trees, steps of fixed length, binary collision checks."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.jit import compiled
from coop_drake.planning.sampling.collision import ObstacleGrid, is_free_placed
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import TeamArrays

_TRAPPED, _ADVANCED, _REACHED = 0, 1, 2


@compiled
def _turn(first: FloatArray, last: FloatArray) -> FloatArray:
    """Difference of two configurations; theta (axis 2) turns in the shorter direction."""
    way = last - first
    way[2] -= 2.0 * pi * np.rint(way[2] / (2.0 * pi))
    return way


@compiled
def _nearest(nodes: FloatArray, count: int, z: FloatArray, scale: FloatArray) -> int:
    """Index of the node nearest to z; a k-d tree was no faster than comparing with all nodes."""
    best, index = np.inf, 0
    for i in range(count):
        total = 0.0
        for k in range(len(z)):
            d = z[k] - nodes[i, k]
            if k == 2:
                d -= 2.0 * pi * np.rint(d / (2.0 * pi))
            total += (d * scale[k]) ** 2
            if total >= best:
                break
        if total < best:
            best, index = total, i
    return index


@compiled
def _extend(
    team: TeamArrays,
    grid: ObstacleGrid,
    nodes: FloatArray,
    parents: IntArray,
    count: int,
    z: FloatArray,
    scale: FloatArray,
    reach: float,
    step: float,
) -> tuple[int, int]:
    """Take one step towards z; return its result and the number of configurations checked."""
    near = _nearest(nodes, count, z, scale)
    way = _turn(nodes[near], z)
    length = np.sqrt(((way * scale) ** 2).sum())
    share = 1.0 if length <= reach else reach / length
    motions = max(1, int(np.ceil(np.abs(way * scale).max() * share / step)))
    poses = np.empty((len(team.links), 5))
    for i in range(motions, 0, -1):
        if not is_free_placed(team, grid, nodes[near] + way * (share * i / motions), 0.0, poses):
            return _TRAPPED, motions - i + 1
    nodes[count] = nodes[near] + way * share
    parents[count] = near
    return (_REACHED if share == 1.0 else _ADVANCED), motions


@compiled
def rrt_connect(
    team: TeamArrays,
    grid: ObstacleGrid,
    start: FloatArray,
    goals: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    scale: FloatArray,
    reach: float,
    step: float,
    random: np.random.Generator,
    budget: int,
) -> tuple[FloatArray, int]:
    """Grow a tree from the start and one from the goals in turns, and join them.

    Args:
        team: The team.
        grid: The floor.
        start: Free configuration, shape (d,).
        goals: Free configurations, shape (G, d).
        lower: Lower ends of what is sampled, shape (d,).
        upper: Upper ends, shape (d,).
        scale: How far a unit of each axis moves the team, shape (d,).
        reach: Longest step of a tree [m].
        step: No axis moves the team further between two checks [m].
        random: Source of the samples.
        budget: Configurations that may be checked.

    Returns:
        Path from start to a goal, theta unwrapped, shape (m, d), without rows if none was found; and the
        number of configurations checked.
    """
    nodes = np.empty((2, budget + len(goals) + 1, len(start)))
    parents = np.empty((2, budget + len(goals) + 1), np.int64)
    parents[:, : len(goals) + 1] = -1
    counts = np.array([1, len(goals)])
    nodes[0, 0] = start
    nodes[1, : len(goals)] = goals
    checks, side = 0, 0
    while checks < budget:
        z = lower + random.random(len(start)) * (upper - lower)
        other = 1 - side
        got, spent = _extend(team, grid, nodes[side], parents[side], counts[side], z, scale, reach, step)
        checks += spent
        if got != _TRAPPED:
            z = nodes[side, counts[side]].copy()
            counts[side] += 1
            got = _ADVANCED
            while got == _ADVANCED and checks < budget:
                got, spent = _extend(
                    team, grid, nodes[other], parents[other], counts[other], z, scale, reach, step
                )
                checks += spent
                if got != _TRAPPED:
                    counts[other] += 1
            if got == _REACHED:
                return _joined(nodes, parents, counts), checks
        side = other
    return np.empty((0, len(start))), checks


@compiled
def _joined(nodes: FloatArray, parents: IntArray, counts: IntArray) -> FloatArray:
    """Path through the newest nodes of both trees, which stand for one configuration."""
    chain = np.empty((counts[0] + counts[1], nodes.shape[2]))
    size, i = 0, counts[0] - 1
    while i >= 0:
        chain[size] = nodes[0, i]
        size, i = size + 1, parents[0, i]
    chain[:size] = chain[:size][::-1].copy()
    i = parents[1, counts[1] - 1]
    while i >= 0:
        chain[size] = chain[size - 1] + _turn(chain[size - 1], nodes[1, i])
        size, i = size + 1, parents[1, i]
    return chain[:size].copy()
