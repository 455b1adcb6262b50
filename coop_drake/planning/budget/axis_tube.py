"""All nominal motions of one axis that enter a cell from a set: a tube around the motion from its middle.

The sampled axis is linear but for its law: over a control period T the command u is held, and a first-order
lag lets the acceleration p follow it, so that the state (x, v, p) is carried over exactly. The law is a line
about the motion from the middle plus a bounded rest, see ``fit_law``. By superposition the departure of the
state is the sum of its responses to the departure at entry and to every sample's rest, each bounded by the
size of that times the magnitude of the response. The rest of a sample depends only on departures before it,
so that one pass forward in time bounds all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import FADING_TIME, bounds_of, track_row
from coop_drake.laws.nominal import lag_factors
from coop_drake.laws.ppc import fading
from coop_drake.planning.budget.law_fit import fit_law, law_memory
from coop_drake.tree.pose import FloatArray

X, X_REACH, V, V_REACH, ACCELERATION, DISTANCE, COMMAND, COMMAND_REACH = range(8)
COLUMNS = 8
"""Columns of a tube, a row for every sample: x and the most that it may depart [rad or m], v and the most
that it may depart [rad/s or m/s], the largest |acceleration| until the next sample, the least distance to the
funnel's bounds until then, and the command and the most that it may depart [rad/s^2 or m/s^2]."""

DIVERGED = 1e3
"""A departure beyond this ends the pass [rad or m]."""


class AxisConditions(NamedTuple):
    """How the nominal motion of an axis is computed.

    Attributes:
        period: T [s].
        lag: Time constant of the actuators [s].
    """

    period: float
    lag: float


LATE = 1
"""Periods for which the command of the cell before acts after a switch [-]: all robots compute at the instant
of the switch, before they hear of it."""


@compiled
def follow_tube(
    row: FloatArray,
    conditions: AxisConditions,
    entry: tuple[float, float, float, float, float],
    jump: float,
    tube: FloatArray,
) -> bool:
    """Write the tube of an axis from its entry on, and return whether it keeps inside the funnel.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: How its motion is computed.
        entry: x and v at the entry, the most that they may depart from these, and the largest |x''| and
            command at the entry.
        jump: What is added to the command and fades, see ``rest_jump``.
        tube: Receives the tube, shape (samples, ``COLUMNS``).
    """
    T, n = conditions.period, tube.shape[0]
    responses, weight = np.zeros((3, n + 3)), np.zeros(n + 3)
    for i in range(3):  # to the departures of x, v and x'' at the entry, then to the disturbances of commands
        responses[i, i], weight[i] = 1.0, entry[2 + i]
    x, v, p, x_reach, v_reach, p_reach = entry[0], entry[1], 0.0, entry[2], entry[3], entry[4]
    lagging, memory = lag_factors(T, conditions.lag), law_memory()
    for k in range(n):
        state = x, x_reach, v, v_reach
        faded = fading(k * T, row[FADING_TIME]) * jump
        u, slope, by_rate, weight[3 + k], most = _command(row, k * T, state, faded, memory)
        if k < LATE:  # all of the command, the old one or the new one, counts as a disturbance
            most = max(most, entry[4])
            u, slope, by_rate, weight[3 + k] = 0.0, 0.0, 0.0, most
        tube[k, COMMAND], tube[k, COMMAND_REACH] = u, most - abs(u)
        _note(tube[k], row, k * T, T, state, max(abs(p) + p_reach, most))
        if not tube[k, DISTANCE] > 0.0 or not x_reach < DIVERGED:
            return False
        gap = p - u
        x, v = x + T * v + 0.5 * T * T * u + lagging[2] * gap, v + T * u + lagging[1] * gap
        p = u + lagging[0] * gap
        x_reach, v_reach, p_reach = _respond(responses, weight, k, (T, slope, by_rate), lagging)
    return True


@compiled(borrows=True)
def _command(
    row: FloatArray, time: float, state: tuple[float, float, float, float], faded: float, memory: FloatArray
) -> tuple[float, float, float, float, float]:
    """Return the undisturbed command, its two slopes, the size of its disturbance and its largest magnitude.

    Args:
        row: The axis.
        time: Time since the cell was entered [s].
        state: x of the undisturbed motion, the most that it may depart, and so for v.
        faded: What is left of the jump of the command at the switch.
        memory: For ``fit_law``.
    """
    x, reach, v, fast = state
    u = track_row(row, time, x, v)[0] + faded
    slope, by_rate, rest, spread = fit_law(row, time, x, reach, v, memory)
    rest += spread * fast
    return u, slope, by_rate, rest, abs(u) + abs(slope) * reach + abs(by_rate) * fast + rest


@compiled(borrows=True)
def _note(
    sample: FloatArray,
    row: FloatArray,
    time: float,
    period: float,
    state: tuple[float, float, float, float],
    fastest: float,
) -> None:
    """Write one row of a tube but its command.

    Between two samples a motion departs from its chord by at most T^2 / 8 times its acceleration, and so does
    a bound of the funnel.
    """
    lower, upper, _, _, bend, other = bounds_of(row, time)
    _, _, _, _, next_bend, next_other = bounds_of(row, time + period)
    bent = max(max(abs(bend), abs(other)), max(abs(next_bend), abs(next_other)))
    sample[X], sample[X_REACH], sample[V], sample[V_REACH] = state
    sample[ACCELERATION] = fastest
    nearest = min(state[0] - state[1] - lower, upper - state[0] - state[1])
    sample[DISTANCE] = nearest - 0.125 * period * period * (fastest + bent)


@compiled(reassociate=True, borrows=True)
def _respond(
    responses: FloatArray,
    weight: FloatArray,
    k: int,
    law: tuple[float, float, float],
    lagging: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Carry all responses over a period; return the sums of their magnitudes times what they respond to.

    The loop has no branches and goes through memory in order, so that vector units are used.
    """
    T, slope, by_rate = law
    left, in_v, in_x = lagging
    x, v, p, last = responses[0], responses[1], responses[2], 3 + k
    x_sum = v_sum = p_sum = 0.0
    for j in range(last):
        u = slope * x[j] + by_rate * v[j]
        gap = p[j] - u
        x[j] = x[j] + T * v[j] + 0.5 * T * T * u + in_x * gap
        v[j] = v[j] + T * u + in_v * gap
        p[j] = u + left * gap
        x_sum += abs(x[j]) * weight[j]
        v_sum += abs(v[j]) * weight[j]
        p_sum += abs(p[j]) * weight[j]
    x[last], v[last], p[last] = 0.5 * T * T - in_x, T - in_v, 1.0 - left
    x_sum += abs(x[last]) * weight[last]
    v_sum += abs(v[last]) * weight[last]
    p_sum += abs(p[last]) * weight[last]
    return x_sum, v_sum, p_sum
