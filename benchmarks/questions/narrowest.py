"""The narrowest straight corridor in which a team fits, found by sampling its angles and joints."""

from __future__ import annotations

from math import inf

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.planning.sampling.collision import bodies_apart
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, place

_DRAWN, _REFINED = 4_000, 8_000
"""Configurations drawn anywhere, and drawn near the best one so far [-]: together some 20 ms."""

_FINEST = 1e-4
"""Final size of the neighbourhood in which configurations are drawn, as a fraction of the ranges [-]."""


def narrowest_corridor(tree: ComponentTree, random: np.random.Generator) -> float:
    """Return the width of the narrowest straight corridor that was found to hold the team [m].

    It is an upper bound of the critical width of a long corridor, and of a door no bound: bodies may pass one
    after the other.

    Args:
        tree: The team.
        random: Source of the samples.
    """
    lower = np.array([0.0, 0.0, -np.pi, *tree.range_lower])
    upper = np.array([0.0, 0.0, np.pi, *tree.range_upper])
    return float(_narrowest(tree.arrays, lower, upper, random, _DRAWN, _REFINED))


@compiled
def _narrowest(
    team: TeamArrays,
    lower: FloatArray,
    upper: FloatArray,
    random: np.random.Generator,
    drawn: int,
    refined: int,
) -> float:
    """Least extent along y of all configurations drawn whose bodies are apart [m]."""
    least, best = inf, np.zeros(len(lower))
    for k in range(drawn + refined):
        z = lower + random.random(len(lower)) * (upper - lower)
        if k >= drawn and least < inf:
            spread = 0.2 * (_FINEST / 0.2) ** ((k - drawn) / refined)
            z = np.minimum(np.maximum(best + spread * (z - 0.5 * (lower + upper)), lower), upper)
        poses = place(team, z)
        extent = _extent(team, poses)
        if extent < least and bodies_apart(team, poses, 0.0):
            least, best = extent, z
    return least


@compiled
def _extent(team: TeamArrays, poses: FloatArray) -> float:
    """Extent of a placed team along y [m]."""
    low, high = inf, -inf
    for piece in range(len(team.pieces)):
        X, radius = poses[team.pieces[piece, 0]], team.radii[piece]
        for v in range(team.pieces[piece, 1], team.pieces[piece, 2]):
            y = X[1] + X[3] * team.vertices[v, 0] + X[2] * team.vertices[v, 1]
            low, high = min(low, y - radius), max(high, y + radius)
    return high - low
