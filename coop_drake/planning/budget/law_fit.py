"""The law of one axis as a straight line and a rest that is bounded."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import track_row
from coop_drake.laws.slopes import slope_bounds
from coop_drake.tree.pose import FloatArray

PIECES = 8
"""Pieces into which the interval of positions is cut [-]: the law's curvature adds to the bound of the rest
with the square of their length, and with eight it adds little."""

SHORTEST = 1e-9
"""Shortest interval for which a line is fitted [rad or m]."""


@compiled
def fit_law(
    row: FloatArray, time: float, position: float, reach: float, rate: float
) -> tuple[float, float, float, float]:
    """Return l, m, R, r with |L(x + a, v + b) - L(x, v) - l a - m b| <= R + r |b| for all |a| <= ``reach``.

    L is the law at one time, x and v are ``position`` and ``rate``. The values of L at the ends of the
    pieces are exact; between them L departs from its chord by at most a quarter of the piece's length times
    the difference of its largest and smallest slope. The slope l makes the rest of a cubic least.

    Args:
        row: The axis, a row of an ``axis_table``.
        time: Time since the cell was entered [s].
        position: x [rad or m].
        reach: Largest |a| [rad or m].
        rate: v [rad/s or m/s].

    Returns:
        l [1/s^2], m [1/s], R [rad/s^2 or m/s^2] and r [1/s].
    """
    reach = max(reach, SHORTEST)
    length = 2.0 * reach / PIECES
    middle = track_row(row, time, position, rate)[0]
    values = np.empty(PIECES + 1)
    for i in range(PIECES + 1):
        values[i] = track_row(row, time, position - reach + i * length, rate)[0] - middle
    quarter = PIECES // 4
    whole, half = values[PIECES] - values[0], values[3 * quarter] - values[quarter]
    slope = (whole + half) / (3.0 * reach)
    rest, v_least, v_most = 0.0, np.inf, -np.inf
    for i in range(PIECES):
        a = -reach + i * length
        centre = position + a + 0.5 * length
        x_lower, x_upper, v_lower, v_upper = slope_bounds(row, time, centre, 0.5 * length, rate)
        ends = max(abs(values[i] - slope * a), abs(values[i + 1] - slope * (a + length)))
        rest = max(rest, ends + 0.25 * length * (x_upper - x_lower))
        v_least, v_most = min(v_least, v_lower), max(v_most, v_upper)
    return slope, 0.5 * (v_least + v_most), rest, 0.5 * (v_most - v_least)
