"""How far the axes of a plan may depart from their nominal motions in one transition, period by period.

The departure e = x - x^ of an axis is the sum of its loop's responses to what enters it, see
``axis_departure.py``. In one period this is at most

    d = |epsilon| (|a^| + c(w^)) + c(w^ + e'_1) - c(w^) + w + (1 + epsilon - f) q,

with the nominal rates w^ of all axes, and c the largest acceleration that rates alone cause where nothing is
commanded: robots command what balances it at the nominal rates, with masses that are wrong by epsilon. e'_1
is what the first term and w alone cause, w being ``axis_error`` and what the friction of joints causes: what
noise adds is small and of any sign. All of this is known from the periods before, so that one pass forward in
time bounds the departures of all axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.nominal import lag_factors
from coop_drake.planning.budget.alarms import axis_errors
from coop_drake.planning.budget.axis_departure import LATE, AxisLoop
from coop_drake.planning.budget.axis_sets import AxisSets
from coop_drake.planning.budget.axis_tube import ACCELERATION, COLUMNS, V
from coop_drake.tree.pose import FloatArray

ATTEMPTS = 30
"""Largest number of larger and larger bounds that are tried [-]."""

GROWTH = 1.01
"""Factor by which a bound is enlarged for the next attempt [-]."""


class Inflow(NamedTuple):
    """What entered the loops of all axes before a cell is entered, for every part of the model's range.

    Attributes:
        past: Largest d, and its part that causes e'_1, of the periods before, the latest last, shape (2,
            parts, axes, memory) [rad/s^2 or m/s^2].
        state: Largest d of all earlier periods and largest lagged pull, shape (2, parts, axes).
    """

    past: FloatArray
    state: FloatArray


class Departures(NamedTuple):
    """How far axes depart in each period of a transition, (periods + 1, axes) each; the last row is for ever.

    Attributes:
        position: Largest |e| [rad or m].
        rate: Largest |e'| [rad/s or m/s].
        acceleration: Largest |e''| [rad/s^2 or m/s^2].
        pull: Largest part of a command that pulls an axis to its nominal motion [rad/s^2 or m/s^2].
        entered: d for every part of the model's range, shape (periods + 1, axes, parts).
    """

    position: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    pull: FloatArray
    entered: FloatArray


class _Scales(NamedTuple):
    """What all axes share.

    Attributes:
        period: T [s].
        model: Largest |epsilon| [-].
        error: w of every axis, shape (axes,) [rad/s^2 or m/s^2].
        rest: Half the width of a part of the model's range [-].
        left: What the lag leaves of a difference after a period [-].
    """

    period: float
    model: float
    error: FloatArray
    rest: float
    left: float


def at_rest(loop: AxisLoop, axes: int) -> Inflow:
    """Return what entered before the start, where all axes rest."""
    parts, _, memory = loop.kicks.shape
    error = np.tile(axis_errors(loop.budget, loop.tracking, axes), (2, parts, 1))
    return Inflow(np.repeat(error[..., None], memory, axis=3), np.stack([error[0], 0.0 * error[0]]))


def departing(
    loop: AxisLoop, sets: Sequence[AxisSets], coupling: FloatArray, before: Inflow, leaving: int
) -> tuple[Departures, Inflow]:
    """Bound how far all axes depart in a transition, and what has entered when the next one begins.

    Args:
        loop: The loop of all axes.
        sets: The sets of their nominal motions.
        coupling: Coefficients of c, zero for k > j, shape (axes, axes, axes).
        before: What entered before this transition.
        leaving: The first sample at which the cell can be left.
    """
    budget, axes, memory = loop.budget, len(sets), before.past.shape[3]
    samples = max(len(tube) for one in sets for tube in one.tubes)
    moving = np.stack([one.moving(samples, budget.period) for one in sets], axis=-1)
    entered = np.empty((*before.past.shape[:3], memory + samples + 1))
    entered[..., :memory] = before.past
    found, state = np.empty((4, samples + 1, axes)), np.concatenate([before.state, before.state[1:]])
    left = lag_factors(budget.period, budget.lag)[0]
    error = axis_errors(budget, loop.tracking, axes)
    scales = _Scales(budget.period, budget.model_error, error, loop.rest, left)
    responses = loop.kicks, loop.sums[:, :, LATE].copy(), loop.noises(axes), loop.errors
    _carry(responses, leaving, scales, coupling, moving, entered, state, found)
    highest = np.maximum.accumulate(entered[..., ::-1], axis=3)[..., ::-1]
    first = min(leaving, samples + 1)
    past = highest[..., first : first + memory].copy()
    of_periods = entered[0, ..., memory:].transpose(2, 1, 0)
    return Departures(found[0], found[1], found[2], found[3], of_periods), Inflow(
        past, np.stack([state[0], state[2]])
    )


def moving_evenly(loop: AxisLoop, coupling: FloatArray, moving: tuple[float, float]) -> Departures:
    """Bound how far axes depart that were at rest and have moved within the same bounds ever since.

    Args:
        loop: The loop of all axes.
        coupling: Coefficients of c, zero for k > j, shape (axes, axes, axes).
        moving: Largest |x^''| and |x^'| of every axis [rad/s^2 or m/s^2, rad/s or m/s].

    Returns:
        The largest ones of all times, arrays of shape (axes,).
    """
    axes, samples = len(coupling), loop.kicks.shape[2]
    tube = np.zeros((samples, COLUMNS))
    tube[:, ACCELERATION], tube[:, V] = moving[0], moving[1] - loop.budget.period * moving[0]
    even = AxisSets((tube,), 0.0, moving[0], moving[0], 0.0, tube[0, V])
    found, _ = departing(loop, [even] * axes, coupling, at_rest(loop, axes), samples)
    return Departures(*(one.max(axis=0) for one in found))


@compiled(borrows=True)
def _rate_terms(coupling: FloatArray, rates: FloatArray) -> float:
    """Return c, the largest acceleration of one axis because of rates up to these [rad/s^2 or m/s^2]."""
    total = 0.0
    for j in range(rates.size):
        for k in range(j + 1):
            total += coupling[j, k] * rates[j] * rates[k]
    return total


@compiled(reassociate=True, borrows=True)
def _answers(kicks: FloatArray, entered: FloatArray, first: FloatArray) -> tuple[float, float, float, float]:
    """Return the sums of the sizes of the responses times what entered, of x, x' and the pull.

    The last number is that of x' to ``first`` alone.
    """
    x = v = q = v_first = 0.0
    for m in range(entered.size):
        x += kicks[0, m] * entered[m]
        v += kicks[1, m] * entered[m]
        q += kicks[2, m] * entered[m]
        v_first += kicks[1, m] * first[m]
    return x, v, q, v_first


_Responses = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""To a unit of acceleration in one period, the oldest first, shape (parts, 3, memory); sums of those that are
older, shape (parts, 3); x, x' and the pull that noise causes, shape (axes, parts, 3); largest |epsilon| of
every part."""


@compiled
def _carry(
    responses: _Responses,
    leaving: int,
    scales: _Scales,
    coupling: FloatArray,
    moving: FloatArray,
    entered: FloatArray,
    state: FloatArray,
    found: FloatArray,
) -> None:
    """Pass through all periods of a transition; the last row of ``moving`` and ``found`` is for ever.

    Args:
        responses: See ``_Responses``.
        leaving: The first sample at which the cell can be left.
        scales: What all axes share.
        coupling: Coefficients of c, shape (axes, axes, axes).
        moving: Largest |x^''| and |x^'| of every period, shape (2, periods, axes).
        entered: Holds d and the part of it that causes e'_1 before the transition, and receives those of
            every period, shape (2, parts, axes, ...).
        state: Largest d until now, lagged pull, and the largest one from the first sample of leaving on; they
            change, shape (3, parts, axes).
        found: Receives the departures, shape (4, periods, axes).
    """
    kicks, late, noise, errors = responses
    parts, axes, memory, ever = len(errors), len(coupling), kicks.shape[2], found.shape[1] - 1
    now = np.zeros((4, parts, axes))
    for k in range(ever):
        for p in range(parts):
            for i in range(axes):
                window = entered[:, p, i, k : memory + k]
                x, v, q, first = _answers(kicks[p], window[0], window[1])
                most = state[0, p, i] = max(state[0, p, i], entered[0, p, i, memory + k - 1])
                now[0, p, i] = noise[i, p, 0] + x + late[p, 0] * most
                now[1, p, i] = noise[i, p, 1] + v + late[p, 1] * most
                pull = noise[i, p, 2] + q + late[p, 2] * most
                now[2, p, i] = max(pull, state[1, p, i])
                now[3, p, i] = first + late[p, 1] * most
                state[1, p, i] = pull + scales.left * max(state[1, p, i] - pull, 0.0)
                if k >= leaving:
                    state[2, p, i] = max(state[2, p, i], now[2, p, i])
        _enter(now, moving[:, k], (coupling, errors), scales, found[:, k], entered[:, :, :, memory + k])
        if k > 0:
            _join(found, now[0], k - 1)
    _settle(responses, coupling, scales, moving[:, ever], entered, state, found)
    _join(found, found[:1, ever], ever - 1)


@compiled(borrows=True)
def _join(found: FloatArray, following: FloatArray, k: int) -> None:
    """Add to the departures of a period those at its end, shape (parts, axes)."""
    for i in range(following.shape[1]):
        for p in range(following.shape[0]):
            found[0, k, i] = max(found[0, k, i], following[p, i])


@compiled
def _enter(
    now: FloatArray,
    moving: FloatArray,
    model: tuple[FloatArray, FloatArray],
    scales: _Scales,
    found: FloatArray,
    entered: FloatArray,
) -> None:
    """Write how far axes depart in one period, and d.

    Args:
        now: Largest |e| and |e'| at its beginning, largest |q| in it, and e'_1 at its beginning, shape (4,
            parts, axes).
        moving: Largest |x^''| and |x^'| in it, shape (2, axes).
        model: Coefficients of c, and the largest |epsilon| of every part.
        scales: What all axes share.
        found: Receives |e|, |e'|, |e''| and |q|, shape (4, axes).
        entered: Receives d and the part of it that causes e'_1, shape (2, parts, axes).
    """
    (coupling, errors), T, axes = model, scales.period, moving.shape[1]
    first, terms = np.zeros(axes), np.zeros(axes)
    for i in range(axes):
        terms[i] = _rate_terms(coupling[i], moving[1])
        for p in range(len(errors)):
            own = errors[p] * (moving[0, i] + terms[i]) + scales.error[i]
            first[i] = max(first[i], now[3, p, i] + T * own)
            entered[1, p, i] = own
    for i in range(axes):
        more, found[:, i] = _rate_terms(coupling[i], moving[1] + first) - terms[i], 0.0
        for p in range(len(errors)):
            push = (1.0 + scales.model) * now[2, p, i] + entered[1, p, i] + more
            entered[0, p, i] = entered[1, p, i] + more + scales.rest * now[2, p, i]
            found[0, i] = max(found[0, i], now[0, p, i] + 0.125 * T * T * push)
            found[1, i], found[2, i] = max(found[1, i], now[1, p, i] + T * push), max(found[2, i], push)
            found[3, i] = max(found[3, i], now[2, p, i])


@compiled
def _settle(
    responses: _Responses,
    coupling: FloatArray,
    scales: _Scales,
    moving: FloatArray,
    entered: FloatArray,
    state: FloatArray,
    found: FloatArray,
) -> None:
    """Bound departures after the tubes' ends: with d as large as in the last periods, d stays so.

    Arguments are those of ``_carry``, ``moving`` being what is never exceeded, shape (2, axes).
    """
    (kicks, late, noise, errors), ever = responses, found.shape[1] - 1
    parts, axes, memory = len(errors), moving.shape[1], kicks.shape[2]
    now, most, flowing = np.zeros((4, parts, axes)), np.zeros((2, parts, axes)), np.zeros((2, parts, axes))
    for j in range(2):
        for p in range(parts):
            for i in range(axes):
                most[j, p, i] = entered[j, p, i, ever : memory + ever].max()
    for _ in range(ATTEMPTS):
        for p in range(parts):
            for i in range(axes):
                state[0, p, i] = max(state[0, p, i], most[0, p, i])
                for j in range(4):
                    to = j % 2 if j == 3 else j
                    caused = kicks[p, to].sum() * most[j // 3, p, i] + late[p, to] * state[0, p, i]
                    now[j, p, i] = caused + (noise[i, p, j] if j < 3 else 0.0)
                now[2, p, i] = max(now[2, p, i], state[1, p, i])
        _enter(now, moving, (coupling, errors), scales, found[:, ever], flowing)
        if (flowing <= most).all():
            break
        most = np.maximum(most, GROWTH * flowing)
    else:
        found[:, ever] = np.inf
    entered[:, :, :, memory + ever] = most
    state[2] = np.maximum(state[2], now[2])
