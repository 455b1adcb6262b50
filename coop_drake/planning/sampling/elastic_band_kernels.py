"""Compiled elastic-band smoothing: paths become shorter in every axis and move away from obstacles."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.planning.sampling.collision_kernels import bodies_apart, team_clearance
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, place

STRIDES = (7, 3, 5, 1, 6, 2, 4, 0)
"""Order in which the samples of a move are checked, each offset with every eighth sample after it."""


@compiled
def _price(team: TeamArrays, grid: ObstacleGrid, z: FloatArray, gap: float, rate: FloatArray) -> float:
    """Cost of a sample: rate[0] / (rate[1] + min(clearance, rate[2])), infinite where it is not free."""
    poses = place(team, z)
    clearance = team_clearance(team, grid, poses, rate[2])
    if clearance <= 0.0 or not bodies_apart(team, poses, gap):
        return np.inf
    price: float = rate[0] / (rate[1] + clearance)
    return price


@compiled
def improve(
    team: TeamArrays,
    grid: ObstacleGrid,
    rate: FloatArray,
    path: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    scale: FloatArray,
    weights: FloatArray,
    gap: float,
    free_end: bool,
    uniforms: FloatArray,
) -> FloatArray:
    """Lower the cost of a path move by move: bumps and straightenings of one axis over a window.

    The cost is the length in the sum of all weighted axes plus a price for every sample by its clearance.

    Args:
        team: The team.
        grid: The floor that the path stays on.
        rate: A sample with clearance c costs rate[0] / (rate[1] + min(c, rate[2])).
        path: Samples, close together, shape (m, d).
        lower: Lower limits, shape (d,); minus infinity where there is none.
        upper: Upper limits, shape (d,).
        scale: How far a unit of each axis moves the team, shape (d,).
        weights: What a unit of each axis costs, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        free_end: Whether the joints of the last sample may move.
        uniforms: Random numbers in [0, 1), one row for each move, shape (k, 5).
    """
    path = path.copy()
    count, size = path.shape
    cost = np.empty(count)
    least = rate[0] / (rate[1] + rate[2])
    for k in range(count):
        cost[k] = _price(team, grid, path[k], gap, rate)
    fresh = np.empty((count, size))
    fresh_cost = np.empty(count)
    for row in range(len(uniforms)):
        u = uniforms[row]
        axis = int(u[0] * size)
        half = 1 << int(u[1] * 7.0)
        middle = 1 + int(u[2] * (count - 1))
        last_free = free_end and axis > 2
        i = max(0, middle - half)
        j = min(count if last_free else count - 1, middle + half)
        if j - i < 2:
            continue
        straight = u[3] < 0.5
        shift = (2.0 * u[4] - 1.0) * 0.3 / scale[axis]
        change = 0.0
        for k in range(i + 1, j):
            fraction = (k - i) / (j - i)
            value = path[k, axis]
            if straight:
                end = path[j, axis] if j < count else path[i, axis]
                value = path[i, axis] + fraction * (end - path[i, axis])
            elif j == count:
                value += shift * min(1.0, 2.0 * fraction)
            else:
                value += shift * min(1.0, 3.0 * min(fraction, 1.0 - fraction))
            for other in range(size):
                fresh[k, other] = path[k, other]
            fresh[k, axis] = min(upper[axis], max(lower[axis], value))
            change += weights[axis] * abs(
                fresh[k, axis] - (path[k - 1, axis] if k == i + 1 else fresh[k - 1, axis])
            )
            change -= weights[axis] * abs(path[k, axis] - path[k - 1, axis])
        if j < count:
            change += weights[axis] * (
                abs(path[j, axis] - fresh[j - 1, axis]) - abs(path[j, axis] - path[j - 1, axis])
            )
        for k in range(i + 1, j):
            change += least - cost[k]
        # Most moves fail: samples far apart from each other show this soonest.
        for first in STRIDES:
            for k in range(i + 1 + first, j, len(STRIDES)):
                if change >= -1e-9:
                    break
                fresh_cost[k] = _price(team, grid, fresh[k], gap, rate)
                change += fresh_cost[k] - least
        if change < -1e-9:
            for k in range(i + 1, j):
                path[k, axis] = fresh[k, axis]
                cost[k] = fresh_cost[k]
    return path


@compiled
def clearances(team: TeamArrays, grid: ObstacleGrid, path: FloatArray, most: float) -> FloatArray:
    """Distance of the team from the walls at every sample, at most ``most``; -1 where it meets one.

    Args:
        team: The team.
        grid: The floor.
        path: Configurations, shape (m, 3 + n).
        most: Distances above this one do not matter [m].

    Returns:
        Distances, shape (m,) [m].
    """
    result = np.empty(len(path))
    for k in range(len(path)):
        result[k] = team_clearance(team, grid, place(team, path[k]), most)
    return result
