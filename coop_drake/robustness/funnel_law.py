"""The law of the axes as the bounds of budgets need it: prescribed performance in quintic funnels.

A later law brings a module with the same functions: its command near a state as a straight line and a bounded
rest, its line about rest once funnels are closed, when they are, and how slowly it comes to rest.
"""

from __future__ import annotations

from math import log

import numpy as np

from coop_drake.answers.budget import QUINTIC_FUNNELS
from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    DECAY_RATE,
    FADING_TIME,
    GOAL_LOWER,
    GOAL_UPPER,
    POSITION_GAIN,
    RAMP_RATE,
    RATE_GAIN,
    SATURATION,
    bounds_of,
    gains_of,
    slope_bounds,
    slopes_between,
    track_row,
)
from coop_drake.laws.ppc import CLOSING, fading, ramped_gain, track_axis, track_distances
from coop_drake.tree.arrays import FloatArray

LAW = QUINTIC_FUNNELS
"""Name and version of this law; a plan whose sets are for another one is refused."""

LONG_AFTER = 100.0
"""Time at which gains are ramped in and funnels closed [s]."""


RAMPED = 6.0
"""mu t after which the gain k1 counts as ramped in [-]: a sixtieth of it is missing then."""

PIECES = 8
"""Pieces into which the interval of positions is cut [-]: the law's curvature adds to the bound of the rest
with the square of their length, and with eight it adds little."""

SHORTEST = 1e-9
"""Shortest interval for which a line is fitted [rad or m]."""

PLACE, Q, S, VALUE, X_LOWER, X_UPPER, V_LOWER, V_UPPER = range(8)
"""Rows of the memory for intermediate results: dl / w, the same where distances saturate, ln(dl / du) and the
law at the ends of all pieces, and the bounds of the slopes in each piece. Loops over rows use vector units,
which halves the time."""

MEMORY = (8, PIECES + 1)
"""Shape of the memory, which need not be allocated for every sample again."""


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
        memory: For intermediate results, shape ``MEMORY``.

    Returns:
        l [1/s^2], m [1/s], R [rad/s^2 or m/s^2] and r [1/s].
    """
    reach = max(reach, SHORTEST)
    bounds, gains = bounds_of(row, time), gains_of(row, time)
    width, saturation, length = bounds[1] - bounds[0], gains[4], 2.0 * reach / PIECES
    for i in range(PIECES + 1):
        memory[PLACE, i] = (position - reach + i * length - bounds[0]) / width
        memory[Q, i] = min(max(memory[PLACE, i], saturation), 1.0 - saturation)
    for i in range(PIECES + 1):
        memory[S, i] = np.log(memory[Q, i] / (1.0 - memory[Q, i]))
    for i in range(PIECES + 1):
        q = memory[Q, i]
        memory[VALUE, i] = track_distances(q * width, (1.0 - q) * width, memory[S, i], rate, bounds, gains)[0]
    for i in range(PIECES):
        first = memory[PLACE, i], memory[Q, i], memory[S, i]
        last = memory[PLACE, i + 1], memory[Q, i + 1], memory[S, i + 1]
        found = slopes_between(bounds, gains, first, last, rate)
        memory[X_LOWER, i], memory[X_UPPER, i], memory[V_LOWER, i], memory[V_UPPER, i] = found
    middle = track_axis(position, rate, bounds, gains)[0]
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
def command_near(
    row: FloatArray, time: float, state: tuple[float, float, float, float], jump: float, memory: FloatArray
) -> tuple[float, float, float, float, float]:
    """Return the undisturbed command, its two slopes, the size of its disturbance and its largest magnitude.

    Args:
        row: The axis.
        time: Time since the cell was entered [s].
        state: x of the undisturbed motion, the most that it may depart, and so for v.
        jump: What is added to the command at the switch and fades.
        memory: For ``fit_law``.
    """
    x, reach, v, fast = state
    u = track_row(row, time, x, v)[0] + fading(time, row[FADING_TIME]) * jump
    slope, by_rate, rest, spread = fit_law(row, time, x, reach, v, memory)
    rest += spread * fast
    return u, slope, by_rate, rest, abs(u) + abs(slope) * reach + abs(by_rate) * fast + rest


def line_at_rest(row: FloatArray, time: float, x: float, v: float) -> tuple[float, float, float, float]:
    """Return the law's slopes, the size of its rest and the largest |x''|, for departures up to x and v."""
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    lower, upper = bounds_of(row, time)[:2]
    missing = row[POSITION_GAIN] - k1
    slope, by_rate, rest, spread = fit_law(row, time, 0.5 * (lower + upper), x, 0.0, np.empty(MEMORY))
    growing = (row[RATE_GAIN] * missing + k1_dot) * x
    growing += missing * (1.0 - log(row[SATURATION])) * v  # |h| <= 1 + |s| <= 1 - ln(saturation)
    rest += spread * v + growing
    return slope, by_rate, rest, abs(slope) * x + abs(by_rate) * v + rest


def slowest_rate(row: FloatArray) -> float:
    """Return the inverse of the law's slowest time constant about the middle of its closed funnel [1/s]."""
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    slopes = slope_bounds(row, LONG_AFTER, middle, 0.0, 0.0)
    stiffness, damping = -slopes[0], -slopes[2]
    return min(stiffness / damping, 0.5 * damping)


def closed_after(row: FloatArray) -> float:
    """Return the time after which the law counts as the one of the closed funnel [s]."""
    ramped = RAMPED / row[RAMP_RATE] if row[RAMP_RATE] > 0.0 else 0.0
    return float(max(max(CLOSING / row[DECAY_RATE], ramped), row[FADING_TIME]))


def jump_at(row: FloatArray, position: float) -> float:
    """Return what is added to the command at a switch and fades, for an axis at rest, see ``switch_jump``."""
    return -float(track_row(row, 0.0, position, 0.0)[0])
