"""Whether limits of rate or acceleration may act on an axis under a budget."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.laws.axis_table import ACCELERATION_LIMIT, LIMIT_GAIN, RATE_LIMIT
from coop_drake.planning.budget.axis_sets import AxisSets, Entry
from coop_drake.planning.budget.axis_tube import ACCELERATION, V_REACH, AxisConditions, V
from coop_drake.tree.pose import FloatArray


def comes_near_limit(
    row: FloatArray, sets: AxisSets, conditions: Sequence[AxisConditions], entry: Entry
) -> bool:
    """Return whether a x' <= g (L^2 - x'^2) / 2 or |a| <= A may fail for what an axis measures and is asked.

    Sets are those of the law without limits; they hold with these where none acts at any time.

    Args:
        row: The axis, a row of an ``axis_table``.
        sets: Its sets.
        conditions: What disturbs it.
        entry: The set in which it entered.
    """
    limit, first = row[RATE_LIMIT], conditions[0]
    if not min(limit, row[ACCELERATION_LIMIT]) < np.inf:
        return False
    factor = min(one.model_factor - one.model_error for one in conditions)
    early = max(abs(entry.rate_lower), abs(entry.rate_upper)) + first.delay * first.period * entry.history
    seen, pushes = [np.array([sets.settled_rate])], [np.array([sets.last])]
    for tube in sets.tubes:
        rates = np.abs(tube[:, V]) + tube[:, V_REACH]
        late = min(first.delay, len(rates))  # for so many samples what was measured before
        seen += [np.full(late, early), rates[: len(rates) - late]]
        pushes.append(tube[:, ACCELERATION])
    measured, accelerations = np.concatenate(seen) + first.rate_noise, np.concatenate(pushes)
    if (accelerations / factor > row[ACCELERATION_LIMIT]).any():
        return True
    if not limit < np.inf:
        return False
    room = 0.5 * row[LIMIT_GAIN] * (limit * limit - measured * measured)
    return bool((measured * accelerations / factor > room).any())
