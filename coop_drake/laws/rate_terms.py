"""Centripetal and Coriolis terms: how much the rates of a team's axes accelerate them by themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.team_chain import team_chain
from coop_drake.laws.team_dynamics import TeamWork, team_accelerations, team_work
from coop_drake.tree.component_tree import Bodies, ComponentTree
from coop_drake.tree.pose import FloatArray


def rate_terms(
    tree: ComponentTree, bodies: Bodies, rotors: Sequence[float], joints: FloatArray
) -> FloatArray:
    """Return how much pairs of rates accelerate the axes (theta, q...) where nothing is commanded.

    The acceleration of axis i is -(M^-1 C)_i, the sum over j and k <= j of a coefficient times w_j w_k. These
    coefficients do not depend on the object's pose.

    Args:
        tree: The team.
        bodies: All bodies.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
        joints: Configurations of the joints, shape (configurations, n) [rad or m].

    Returns:
        Sizes of the coefficients, [..., i, j, k], zero for k > j, shape (configurations, axes, axes, axes).
    """
    chain, axes = team_chain(tree, bodies, rotors), 1 + joints.shape[1]
    coefficients = np.zeros((len(joints), axes, axes, axes))
    _write_coefficients(chain, np.ascontiguousarray(joints), team_work(chain), coefficients)
    return coefficients


@compiled
def _write_coefficients(
    chain: FloatArray, joints: FloatArray, work: TeamWork, coefficients: FloatArray
) -> None:
    """Write the sizes of all coefficients, by the accelerations at unit rates of one axis and of two."""
    axes = joints.shape[1] + 1
    n = axes + 2
    state, efforts, own = np.zeros(2 * n), np.zeros(n), np.empty((axes, n))
    both = np.empty(n)
    for c in range(joints.shape[0]):
        state[3:n] = joints[c]
        for j in range(axes):
            _accelerate(chain, state, j, j, efforts, work, own[j])
            for k in range(j):
                _accelerate(chain, state, j, k, efforts, work, both)
                for i in range(axes):
                    coefficients[c, i, j, k] = abs(both[2 + i] - own[j, 2 + i] - own[k, 2 + i])
            for i in range(axes):
                coefficients[c, i, j, j] = abs(own[j, 2 + i])


@compiled
def _accelerate(
    chain: FloatArray,
    state: FloatArray,
    j: int,
    k: int,
    efforts: FloatArray,
    work: TeamWork,
    accelerations: FloatArray,
) -> None:
    """Write the accelerations at unit rates of axes j and k alone, without forces."""
    n = accelerations.size
    state[n:] = 0.0
    state[n + 2 + j] = state[n + 2 + k] = 1.0
    nothing, nowhere = np.empty(0, dtype=np.int64), np.empty((0, 3))
    team_accelerations(chain, nothing, nowhere, nowhere, efforts, 0.0, state, work, accelerations)
