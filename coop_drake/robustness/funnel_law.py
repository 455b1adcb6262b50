"""The law of one axis as a straight line and a rest that is bounded."""

from __future__ import annotations

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import bounds_of, gains_of, saturated, slopes_between
from coop_drake.laws.ppc import track_axis, track_distances
from coop_drake.tree.pose import FloatArray

PIECES = 8
"""Pieces into which the interval of positions is cut [-]: the law's curvature adds to the bound of the rest
with the square of their length, and with eight it adds little."""

SHORTEST = 1e-9
"""Shortest interval for which a line is fitted [rad or m]."""

PLACE, Q, S, VALUE, X_LOWER, X_UPPER, V_LOWER, V_UPPER = range(8)
"""Rows of the memory for intermediate results: ``place_in`` and the law at the ends of all pieces, and the
bounds of the slopes in each piece. Loops over rows use vector units, which halves the time."""


@compiled
def law_memory() -> FloatArray:
    """Return memory for ``fit_law``, which need not be allocated for every sample again."""
    return np.empty((8, PIECES + 1))


@compiled(borrows=True)
def fit_law(
    row: FloatArray, time: float, position: float, reach: float, rate: float, memory: FloatArray
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
        memory: For intermediate results, see ``law_memory``.

    Returns:
        l [1/s^2], m [1/s], R [rad/s^2 or m/s^2] and r [1/s].
    """
    reach = max(reach, SHORTEST)
    bounds, gains = bounds_of(row, time), gains_of(row, time)
    _tabulate(bounds, gains, (position, reach, rate), memory)
    middle, length = track_axis(position, rate, bounds, gains)[0], 2.0 * reach / PIECES
    quarter, values = PIECES // 4, memory[VALUE]
    whole, half = values[PIECES] - values[0], values[3 * quarter] - values[quarter]
    slope = (whole + half) / (3.0 * reach)
    rest, v_least, v_most = 0.0, np.inf, -np.inf
    for i in range(PIECES):
        a = -reach + i * length
        ends = max(abs(values[i] - middle - slope * a), abs(values[i + 1] - middle - slope * (a + length)))
        rest = max(rest, ends + 0.25 * length * (memory[X_UPPER, i] - memory[X_LOWER, i]))
        v_least, v_most = min(v_least, memory[V_LOWER, i]), max(v_most, memory[V_UPPER, i])
    return slope, 0.5 * (v_least + v_most), rest, 0.5 * (v_most - v_least)


@compiled(borrows=True)
def _tabulate(
    bounds: tuple[float, float, float, float, float, float],
    gains: tuple[float, float, float, float, float],
    about: tuple[float, float, float],
    memory: FloatArray,
) -> None:
    """Write the law at the ends of all pieces about (x, reach, v), and bounds of its slopes between them."""
    position, reach, rate = about
    pieces, width, saturation = memory.shape[1] - 1, bounds[1] - bounds[0], gains[4]
    length = 2.0 * reach / pieces
    for i in range(pieces + 1):
        memory[PLACE, i] = (position - reach + i * length - bounds[0]) / width
        memory[Q, i] = saturated(memory[PLACE, i], saturation)
    for i in range(pieces + 1):
        memory[S, i] = np.log(memory[Q, i] / (1.0 - memory[Q, i]))
    for i in range(pieces + 1):
        q = memory[Q, i]
        memory[VALUE, i] = track_distances(q * width, (1.0 - q) * width, memory[S, i], rate, bounds, gains)[0]
    for i in range(pieces):
        first = memory[PLACE, i], memory[Q, i], memory[S, i]
        last = memory[PLACE, i + 1], memory[Q, i + 1], memory[S, i + 1]
        found = slopes_between(bounds, gains, first, last, rate)
        memory[X_LOWER, i], memory[X_UPPER, i], memory[V_LOWER, i], memory[V_UPPER, i] = found
