"""Compiled samples around a guide path: along it or where trees have come far, component by component."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.planning.sampling.collision_kernels import component_is_free
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, place_component

__all__ = ["GuidePath", "SampledRegion", "draw", "furthest_row", "guide_row"]

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


@compiled
def guide_row(region: SampledRegion, number: float, front: int) -> int:
    """Row of the guide to sample around, for a random number in [0, 1) and the furthest row reached."""
    count = len(region.guide)
    if count <= region.long:
        return min(count - 1, int(number * count))
    if number < _EVERYWHERE:
        return int(number / _EVERYWHERE * count)
    first, last = max(0, front - _WINDOW), min(count, front + _WINDOW + 1)
    return first + int((number - _EVERYWHERE) / (1.0 - _EVERYWHERE) * (last - first))


@compiled
def furthest_row(region: SampledRegion, front: int, side: int, z: FloatArray) -> int:
    """Furthest row of the guide that the tree of a side has reached, now that it has a node at z."""
    guide = region.guide
    step, row = 1 - 2 * side, front
    for _ in range(2 * _WINDOW if len(guide) > region.long else 0):
        row += step
        if row < 0 or row >= len(guide):
            break
        if (z[0] - guide[row, 0]) ** 2 + (z[1] - guide[row, 1]) ** 2 < _AT_ROW * _AT_ROW:
            front = row
    return front


@compiled(inlined=True)
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


@compiled
def draw(
    team: TeamArrays, grid: ObstacleGrid, region: SampledRegion, u: FloatArray, at: int, gap: float
) -> FloatArray:
    """Draw one sample whose components, from the object outwards, get other values until they are free.

    Few samples of a large team are free otherwise.

    Args:
        team: The team.
        grid: The floor.
        region: What is sampled.
        u: Random numbers in [0, 1), shape (2 + d,).
        at: Row of the guide to sample around.
        gap: Distance that pairs of bodies must keep [m].

    Returns:
        A configuration, which need not be free, shape (d,) [m, rad].
    """
    z = np.empty(len(region.lower))
    for k in range(len(z)):
        z[k] = _value(region, u, at, k, u[2 + k])
    poses = np.empty((len(team.links), 5))
    for component in range(len(team.links) if region.tries > 1 else 0):
        for number in range(1, region.tries + 1):
            place_component(team, z, component, poses)
            if number == region.tries or component_is_free(team, grid, poses, component, gap):
                break
            posed = team.links[component, 0] < 0
            first, last = (0, 3) if posed else (team.links[component, 1], team.links[component, 1] + 1)
            for k in range(first, last):
                step = _STEPS[k if posed else 3]
                z[k] = _value(region, u, at, k, (u[2 + k] + number * step) % 1.0)
    return z
