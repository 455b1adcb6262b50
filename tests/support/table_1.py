"""Transitions of Table 1, for tests that play its axes alone."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.arrays import FloatArray
from paper.table_1 import ANGLE_TOLERANCE, GOAL_ANGLE, START


def table_transitions(table: FloatArray) -> list[dict[str, FloatArray]]:
    """Return, for every row, the slice's ends, the goal interval's ends and where the axes rest on entry.

    Args:
        table: Rows as printed, shape (m, 6) [rad].
    """
    lower, upper = table[:, 0::2].copy(), table[:, 1::2].copy()
    goal_lower, goal_upper = lower.copy(), upper.copy()
    goal_lower[:-1], goal_upper[:-1] = np.maximum(lower[:-1], lower[1:]), np.minimum(upper[:-1], upper[1:])
    goal_lower[-1, 0], goal_upper[-1, 0] = GOAL_ANGLE - ANGLE_TOLERANCE, GOAL_ANGLE + ANGLE_TOLERANCE
    resting = np.vstack([START, 0.5 * (goal_lower + goal_upper)[:-1]])
    return [
        {
            "slice_lower": lower[i],
            "slice_upper": upper[i],
            "goal_lower": goal_lower[i],
            "goal_upper": goal_upper[i],
            "resting": resting[i],
        }
        for i in range(len(table))
    ]
