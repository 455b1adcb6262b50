"""How much the rates of the axes can accelerate them by themselves in every cell of a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.laws.rate_terms import rate_terms
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray

CONFIGURATIONS = 64
"""Configurations of the joints that are tried in every cell [-]."""

SLACK = 1.1
"""Factor by which coefficients are larger than those found [-]: in cells of 0.4 rad in each joint of `elbow`,
other configurations have up to 0.97 times as large ones."""


def cell_couplings(budget: Budget, tree: ComponentTree, cells: Sequence[Cell]) -> FloatArray:
    """Return the largest coefficients of ``rate_terms`` in every cell, shape (cells, 1 + n, 1 + n, 1 + n).

    Args:
        budget: Has the bodies; all coefficients are zero without them.
        tree: The team.
        cells: The cells.
    """
    axes, n = 1 + len(tree.joints), len(tree.joints)
    if not budget.bodies:
        return np.zeros((len(cells), axes, axes, axes))
    lower, upper = (np.array([getattr(cell, side)[1:] for cell in cells]) for side in ("lower", "upper"))
    joints = lower[:, None] + configurations(n) * (upper - lower)[:, None]
    found = rate_terms(tree, budget.bodies, budget.rotors, joints.reshape(-1, n))
    most: FloatArray = found.reshape(len(cells), -1, axes, axes, axes).max(axis=1)
    return SLACK * most


def configurations(joints: int) -> FloatArray:
    """Return where in the joints' intervals they are tried, from 0 to 1, shape (CONFIGURATIONS, joints).

    Roots of whole numbers spread them evenly; half of every joint's values are moved to the ends.
    """
    steps = np.sqrt(1.0 + np.arange(1, 2 * joints + 1))
    steps = steps[steps % 1.0 > 0.0][:joints]
    spread = np.arange(1, CONFIGURATIONS + 1)[:, None] * steps % 1.0
    placed: FloatArray = np.clip(2.0 * spread - 0.5, 0.0, 1.0)
    return placed
