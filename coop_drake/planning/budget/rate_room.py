"""Whether limits of rate or acceleration may act on an axis under a budget."""

from __future__ import annotations

import numpy as np

from coop_drake.laws.axis_table import ACCELERATION_LIMIT, LIMIT_GAIN, RATE_LIMIT
from coop_drake.planning.budget.axis_sets import AxisSets
from coop_drake.planning.budget.axis_tube import ACCELERATION, V_REACH, V
from coop_drake.tree.pose import FloatArray


def comes_near_limit(row: FloatArray, sets: AxisSets) -> bool:
    """Return whether a x' <= g (L^2 - x'^2) / 2 or |a| <= A may fail for a nominal motion.

    Sets are those of the law without limits; they hold with these where none acts at any time.

    Args:
        row: The axis, a row of an ``axis_table``.
        sets: Its sets.
    """
    limit = row[RATE_LIMIT]
    if not min(limit, row[ACCELERATION_LIMIT]) < np.inf:
        return False
    rates = np.concatenate(
        [[sets.settled_rate], *(np.abs(tube[:, V]) + tube[:, V_REACH] for tube in sets.tubes)]
    )
    accelerations = np.concatenate([[sets.last], *(tube[:, ACCELERATION] for tube in sets.tubes)])
    if (accelerations > row[ACCELERATION_LIMIT]).any():
        return True
    if not limit < np.inf:
        return False
    return bool((rates * accelerations > 0.5 * row[LIMIT_GAIN] * (limit * limit - rates * rates)).any())
