"""How a team begins its current cell anew where its drives have brought it to rest.

An axis that was braked may rest outside its slice, or so near to its end that V would be too large. Then its
funnel begins wider than the slice, with the axis inside, and closes to the goal interval like every other.
Meanwhile p_G waits where the object rests for ``POSITION_WAITS``: the team has come from its slices on nearly
the same way, which was free, and goes back on it before anything else moves.
"""

from __future__ import annotations

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import ENERGY_BOUND, SLICE_LOWER, SLICE_UPPER, track_row
from coop_drake.laws.readiness import funnel_margin
from coop_drake.tree.pose import FloatArray

POSITION_WAITS = 1.0
"""Time for which p_G waits [s]: funnels of plans close to their goal intervals within about half of it."""

_FIRST_REACH = 0.02
"""Smallest distance of an axis to the end of its wider slice that is tried, over the slice's width [-]."""

_LARGEST_REACH = 1.0
"""Largest one [-]: a whole slice away no certificate says anything about what is free."""

_STEP = 1.3
"""Factor between one that is tried and the next [-]."""


@compiled
def widen_slice(row: FloatArray, position: float, wide: FloatArray) -> float:
    """Write a row whose slice is just so wide that an axis at rest may begin it; return the margin of its V.

    The margin is negative where no slice that is tried is wide enough, or the axis rests further outside its
    slice than ``_LARGEST_REACH`` of the width.

    Args:
        row: The axis in the cell, a row of an ``axis_table``.
        position: x, where it rests [rad or m].
        wide: Receives the row, shape (``LAW_COLUMNS``,).
    """
    wide[:] = row
    lower, upper = row[SLICE_LOWER], row[SLICE_UPPER]
    width, reach = upper - lower, _FIRST_REACH
    outside = max(lower - position, position - upper)
    if outside > _LARGEST_REACH * width:
        return float(-outside / width)
    margin = -1.0
    if outside < 0.0:
        margin = funnel_margin(track_row(wide, 0.0, position, 0.0)[1], row[ENERGY_BOUND])
    while margin < 0.0 and reach <= _LARGEST_REACH:
        wide[SLICE_LOWER] = min(lower, position - reach * width)
        wide[SLICE_UPPER] = max(upper, position + reach * width)
        margin = funnel_margin(track_row(wide, 0.0, position, 0.0)[1], row[ENERGY_BOUND])
        reach *= _STEP
    return float(margin)
