"""All motions of one axis that a budget of departures allows: a tube around the motion without departures.

The sampled axis is linear but for its law: over a control period T the command u is held, and a first-order
lag lets the acceleration p follow it, so that the state (x, v, p) is carried over exactly. The law is a line
about the undisturbed motion plus a bounded rest, see ``fit_law``. By superposition the departure of the state
is the sum of its responses to the departure at entry and to every sample's disturbance of the command, each
bounded by the size of that disturbance times the magnitude of the response. Measurements that are whole
periods old enter the responses exactly. What disturbs a command depends only on departures that were
measured before, so that one pass forward in time bounds all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import FADING_TIME, bounds_of, track_row
from coop_drake.laws.hand_over import fading
from coop_drake.laws.nominal_axes import lag_factors
from coop_drake.planning.budget.law_fit import fit_law, law_memory
from coop_drake.tree.pose import FloatArray

X, X_REACH, V, V_REACH, ACCELERATION, DISTANCE = range(6)
COLUMNS = 6
"""Columns of a tube, a row for every sample: x and the most that it may depart [rad or m], v and the most
that it may depart [rad/s or m/s], the largest |acceleration| until the next sample, and the least distance to
the funnel's bounds until then."""

DIVERGED = 1e3
"""A departure beyond this ends the pass [rad or m]."""


class AxisConditions(NamedTuple):
    """What disturbs one axis.

    Attributes:
        period: T [s].
        delay: Age of a measurement in whole periods [-].
        lag: Time constant of the actuators [s].
        position_noise: Largest error of a measured position [rad or m].
        rate_noise: Largest error of a measured rate [rad/s or m/s].
        model_factor: Factor by which the model makes accelerations too large [-].
        model_error: Largest difference of that factor from ``model_factor`` [-].
        acceleration_error: Largest error of the acceleration besides [rad/s^2 or m/s^2].
        late: For how many periods after the entry the command of the cell before may act [-].
    """

    period: float
    delay: int
    lag: float
    position_noise: float
    rate_noise: float
    model_factor: float
    model_error: float
    acceleration_error: float
    late: int


@compiled
def follow_tube(
    row: FloatArray,
    conditions: AxisConditions,
    entry: tuple[float, float, float, float, float, float],
    jump: float,
    tube: FloatArray,
) -> bool:
    """Write the tube of an axis from its entry on, and return whether it keeps inside the funnel.

    Before the entry the axis moved as its acceleration then allows.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: What disturbs it.
        entry: x and v at the entry, the most that they may depart from these, the largest |x''| and command
            at the entry, and the largest |x''| before the entry, as far back as the oldest measurement
            that is used after it.
        jump: What is added to the command and fades, see ``rest_jump``.
        tube: Receives the tube, shape (samples, ``COLUMNS``).
    """
    T, delay, n = conditions.period, conditions.delay, tube.shape[0]
    responses, p, weight, nominal, reaches = _before(conditions, entry, n)
    before, jump = (entry[4], entry[5]), conditions.model_factor * jump
    p_nominal, p_reach = 0.0, entry[4]
    lagging, memory = lag_factors(T, conditions.lag), law_memory()
    for k in range(n):
        i = k + delay
        seen = nominal[0, k], nominal[1, k], reaches[0, k], reaches[1, k]
        faded = fading(k * T, row[FADING_TIME]) * jump
        u, slope, by_rate, weight[3 + k], most = _command(row, conditions, k, seen, before, faded, memory)
        fastest = max(abs(p_nominal) + p_reach, most)
        now = nominal[0, i], reaches[0, i], nominal[1, i], reaches[1, i]
        _note(tube[k], row, k * T, T, now, fastest)
        if not tube[k, DISTANCE] > 0.0 or not reaches[0, i] < DIVERGED:
            return False
        gap = p_nominal - u
        nominal[0, i + 1] = nominal[0, i] + T * nominal[1, i] + 0.5 * T * T * u + lagging[2] * gap
        nominal[1, i + 1] = nominal[1, i] + T * u + lagging[1] * gap
        p_nominal = u + lagging[0] * gap
        reaches[0, i + 1], reaches[1, i + 1], p_reach = _respond(
            responses, p, weight, k, (T, slope, by_rate), lagging
        )
    return True


@compiled
def _before(
    conditions: AxisConditions, entry: tuple[float, float, float, float, float, float], n: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return responses, those of p, what they respond to, the undisturbed motion, and its largest departures.

    Responses to the departures of x, v and x'' at the entry, then to the disturbances of n commands; all with
    the values of the periods before the entry, of which measurements speak at first.
    """
    T, delay, ring = conditions.period, conditions.delay, conditions.delay + 1
    responses, p, weight = np.zeros((2, ring, n + 3)), np.zeros(n + 3), np.zeros(n + 3)
    weight[0], weight[1], weight[2] = entry[2], entry[3], entry[4]
    p[2] = 1.0
    nominal, reaches = np.zeros((2, n + ring)), np.empty((2, n + ring))
    for q in range(ring):
        nominal[0, delay - q], nominal[1, delay - q] = entry[0] - q * T * entry[1], entry[1]
        reaches[0, delay - q], reaches[1, delay - q] = entry[2] + q * T * entry[3], entry[3]
        at = (ring - q) % ring
        responses[0, at, 0], responses[0, at, 1], responses[1, at, 1] = 1.0, -q * T, 1.0
    return responses, p, weight, nominal, reaches


@compiled
def _command(
    row: FloatArray,
    conditions: AxisConditions,
    k: int,
    seen: tuple[float, float, float, float],
    before: tuple[float, float],
    faded: float,
    memory: FloatArray,
) -> tuple[float, float, float, float, float]:
    """Return the undisturbed command, its two slopes, the size of its disturbance and its largest magnitude.

    Args:
        row: The axis.
        conditions: What disturbs it.
        k: The sample.
        seen: x and v of the undisturbed motion when it was measured, and the most that they may depart.
        before: Largest command at the entry, and largest |x''| before it, by which measurements from before
            the entry are uncertain.
        faded: What is left of the jump of the command at the switch.
        memory: For ``fit_law``.
    """
    ago = max(conditions.delay - k, 0) * conditions.period
    x_noise = conditions.position_noise + 0.5 * ago * ago * before[1]
    v_noise = conditions.rate_noise + ago * before[1]
    reach, fast = seen[2] + x_noise, seen[3] + v_noise
    time, factor = k * conditions.period, conditions.model_factor
    u = factor * track_row(row, time, seen[0], seen[1])[0] + faded
    slope, by_rate, rest, spread = fit_law(row, time, seen[0], reach, seen[1], memory)
    slope, by_rate, rest = factor * slope, factor * by_rate, factor * (rest + spread * fast)
    size = abs(slope) * x_noise + abs(by_rate) * v_noise + rest
    most = abs(u) + abs(slope) * reach + abs(by_rate) * fast + rest
    if k < conditions.late:  # all of the command, the old one or the new one, counts as a disturbance
        most = max(most, before[0])
        u, slope, by_rate, size = 0.0, 0.0, 0.0, most
    error = conditions.model_error / factor * most + conditions.acceleration_error
    return u, slope, by_rate, size + error, most + error


@compiled
def _note(
    sample: FloatArray,
    row: FloatArray,
    time: float,
    period: float,
    state: tuple[float, float, float, float],
    fastest: float,
) -> None:
    """Write one row of a tube.

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


@compiled(reassociate=True)
def _respond(
    responses: FloatArray,
    p: FloatArray,
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
    ring, last = responses.shape[1], 3 + k
    x_now, v_now = responses[0, k % ring], responses[1, k % ring]
    x_old, v_old = responses[0, (k + 1) % ring], responses[1, (k + 1) % ring]
    x_sum = v_sum = p_sum = 0.0
    for j in range(last):
        u = slope * x_old[j] + by_rate * v_old[j]
        gap = p[j] - u
        x = x_now[j] + T * v_now[j] + 0.5 * T * T * u + in_x * gap
        v = v_now[j] + T * u + in_v * gap
        p[j] = u + left * gap
        x_old[j], v_old[j] = x, v
        x_sum += abs(x) * weight[j]
        v_sum += abs(v) * weight[j]
        p_sum += abs(p[j]) * weight[j]
    x_old[last], v_old[last], p[last] = 0.5 * T * T - in_x, T - in_v, 1.0 - left
    x_sum += abs(x_old[last]) * weight[last]
    v_sum += abs(v_old[last]) * weight[last]
    p_sum += abs(p[last]) * weight[last]
    return x_sum, v_sum, p_sum
