"""Table 1 of the paper as data: the intervals of theta, q_11 and q_21 in its thirty cells."""

from __future__ import annotations

import numpy as np

from coop_drake.geometry.pose import FloatArray

# Columns as printed: theta_l, theta_u, then lower and upper end of q_11, lower and upper end of q_21.
PRINTED = np.array(
    [
        [1.470, 1.867, -0.100, 0.567, -0.100, 0.567],
        [1.667, 2.065, -0.100, 0.567, -0.567, 0.100],
        [1.863, 2.456, -0.100, 0.567, -1.035, 0.367],
        [1.863, 2.456, -0.100, 0.333, -1.870, -0.835],
        [2.256, 2.652, -0.100, 0.333, -1.503, -0.835],
        [2.452, 2.849, -0.100, 0.333, -1.035, -0.368],
        [2.649, 2.947, -0.100, 0.217, -0.567, 0.100],
        [2.747, 3.045, -0.050, 0.108, -0.050, 0.108],
        [2.895, 3.191, -0.050, 0.108, -0.050, 0.108],
        [3.091, 3.388, -0.050, 0.158, -0.158, 0.050],
        [3.287, 3.584, 0.067, 0.284, -0.284, -0.067],
        [3.484, 3.781, 0.184, 0.518, -0.518, -0.184],
        [3.681, 3.977, 0.418, 0.985, -0.985, -0.418],
        [3.877, 4.172, 0.651, 0.984, -0.984, -0.651],
        [4.072, 4.370, 0.418, 0.985, -0.985, -0.418],
        [4.270, 4.576, 0.184, 0.518, -0.518, -0.184],
        [4.476, 4.762, 0.067, 0.284, -0.284, -0.067],
        [4.564, 4.762, 0.067, 0.284, -0.284, -0.067],
        [4.564, 4.762, -0.050, 0.108, -0.108, 0.050],
        [4.564, 4.762, -0.050, 0.108, -0.108, 0.050],
        [4.564, 4.762, -0.985, 0.050, -0.108, 0.050],
        [4.564, 4.762, -1.453, -0.885, -0.108, 0.050],
        [4.564, 4.762, -1.687, -1.353, -0.108, 0.050],
        [4.564, 4.762, -1.687, -1.528, -0.108, -0.050],
        [4.564, 4.762, -1.687, -1.528, -0.168, -0.008],
        [4.564, 4.762, -1.687, -1.528, -0.284, -0.067],
        [4.564, 4.762, -1.687, -1.528, -0.518, -0.184],
        [4.564, 4.762, -1.687, -1.528, -0.985, -0.418],
        [4.564, 4.762, -1.687, -1.528, -1.453, -0.885],
        [4.564, 4.762, -1.687, -1.528, -1.687, -1.353],
    ]
)

# Two signs are misprinted: any other width is the joint's range halved some times, plus the overlap.
CORRECTED = PRINTED.copy()
CORRECTED[2, 5] = -0.367
CORRECTED[23, 5] = 0.050

START = np.array([1.57, 0.0, 0.0])
GOAL_ANGLE = 4.663
ANGLE_TOLERANCE = 0.02


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
