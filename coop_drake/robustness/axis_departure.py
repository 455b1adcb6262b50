"""How far an axis may depart from its nominal motion under a budget.

Let e = x - x^ be the departure of an axis from its nominal motion, see ``laws/nominal.py``. Robots
command, at sample k and with measurements that are m periods old, L + q_k with the pull

    q_k = -K_a (e_(k-m) + n_x) - zeta_a (e'_(k-m) + n_v),

which acts with the same lag as L. With the acceleration a^ of the nominal motion, the lagged pull q and the
factor 1 + epsilon by which the model makes accelerations too large, f being the middle of a part of its
range,

    e'' = f q + (1 + epsilon - f) q + epsilon a^ + w.

The loop e'' = f q is linear and does not vary in time, so that |e| is at most the sum over all samples of
its responses' magnitudes times the largest size of what enters: noise of a command, and accelerations. Hand-
overs and funnels do not appear in it. Only a^ is larger in one transition than in another: what entered
longer ago than ``MEMORY`` is counted with its largest size in the whole plan.

Where the age of measurements may be wrong by s, what was measured belongs to another instant than the nominal
state with which it is compared. So n_x is larger by s times the largest |x'| of the axis at any time, and n_v
by s times its largest |x''|, which the plan states (``AxisTracking``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget
from coop_drake.jit import compiled
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.nominal import lag_factors
from coop_drake.robustness.alarms import axis_errors, mistaken, unseen_of
from coop_drake.robustness.nominal_axes import AxisSets, even_sets
from coop_drake.tree.arrays import FloatArray

MODEL_PARTS = 5
"""Parts into which the range of the model's error is cut [-]; within each only the rest is a disturbance."""

HORIZON = 4.0
"""Longest time for which responses are summed [s]."""

LEFT = 1e-9
"""Responses to a unit departure are followed until they are below this [-]; a loop in which they stay above
it for ``HORIZON`` is refused."""

MEMORY = 0.3
"""Time for which the accelerations of former transitions count with their own sizes [s]: less than a
hundredth of a response of typical gains is left after it."""

TYPICAL_ACCELERATION = 8.0
"""Acceleration of a nominal motion for which the gains are chosen [rad/s^2 or m/s^2]: two thirds of the
largest one of a funnel's bound in the shipped rule of gains."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than the responses after
``HORIZON`` and another way to round need."""

AWAY, FAST, PULL, AHEAD = range(4)
"""What responds: e [rad or m], e' [rad/s or m/s], the pull [rad/s^2 or m/s^2], and e + t e' [rad or m], t
being how long nobody may know of a departure."""

COMMANDED, PUSH, OLD = range(3)
"""To what: a unit of command in each period, a unit of acceleration, and one from before ``MEMORY``."""


@dataclass(frozen=True)
class AxisLoop:
    """The loop of all axes under a budget.

    Attributes:
        tracking: Its gains.
        budget: The departures to be tolerated.
        sums: Of every part of the model's range the sums of responses, shape (parts, 4, 3).
        kicks: Responses to a unit of acceleration in one period within ``MEMORY``, the oldest first, shape
            (parts, 4, memory).
        answers: Pull that answers a unit of command in one of the periods before, likewise, with its sign,
            shape (parts, memory).
    """

    tracking: AxisTracking
    budget: Budget
    sums: FloatArray
    kicks: FloatArray
    answers: FloatArray

    @property
    def rest(self) -> float:
        """By how much the model's factor may differ from f within a part [-]."""
        return _rest(self.budget)

    @property
    def factors(self) -> list[float]:
        """The factors f of all parts of the model's range [-]."""
        return _factors(self.budget)

    @property
    def errors(self) -> FloatArray:
        """Largest error of the model in every part, shape (parts,) [-]."""
        return np.abs(np.array(self.factors) - 1.0) + self.rest

    def noises(self, axes: int) -> FloatArray:
        """Return what noise causes of e, e', the pull and e + t e', shape (axes, parts, 4)."""
        wrong = np.array([[self.budget.angle_noise], [self.budget.rate_noise]])
        wrong = wrong + mistaken(self.budget, self.tracking, axes)
        noise = self.tracking.stiffness * wrong[0] + self.tracking.damping * wrong[1]
        caused: FloatArray = noise[:, None, None] * (self.sums[:, :, COMMANDED] + [0.0, 0.0, 1.0, 0.0])
        return caused

    def typical(self) -> tuple[float, float]:
        """Return the largest departures of a typical axis [rad or m] and of its rate [rad/s or m/s].

        Errors of clocks are not counted, for they depend on how fast the axes are.
        """
        pushes, axes = self.sums[:, :, PUSH], max(len(self.tracking.disturbance) - 1, 1)
        noises = self.noises(1)[0]
        steady = axis_errors(self.budget, self.tracking, axes).mean() + self.errors * TYPICAL_ACCELERATION
        pull = (noises[:, PULL] + steady * pushes[:, PULL]) / (1.0 - self.rest * pushes[:, PULL])
        found = noises[:, :PULL] + (steady + self.rest * pull)[:, None] * pushes[:, :PULL]
        away, fast = found.max(axis=0).tolist()
        return away, fast


def axis_loop(tracking: AxisTracking, budget: Budget) -> AxisLoop | None:
    """Return the loop with some gains, None where it is not stable for every error of the model."""
    T = budget.period
    periods = whole_periods(budget.delay, T), whole_periods(HORIZON, T)
    gains, factors = (tracking.stiffness, tracking.damping), _factors(budget)
    kicks = np.zeros((len(factors), 4, whole_periods(MEMORY, T)))
    answers = np.zeros(kicks[:, 0].shape)
    runs, times = zip(factors, kicks, answers, strict=True), (T, budget.lag, unseen_of(budget))
    sums = np.array([_sums(gains, times, factor, periods, own, pull) for factor, own, pull in runs])
    good = np.isfinite(sums).all() and (_rest(budget) * sums[:, PULL, PUSH] < 1.0).all()
    return AxisLoop(tracking, budget, sums, kicks, answers) if good else None


def _factors(budget: Budget) -> list[float]:
    """Return f of every part of the model's range."""
    parts = MODEL_PARTS if budget.model_error > 0.0 else 1
    return [1.0 + budget.model_error * ((2 * part + 1) / parts - 1.0) for part in range(parts)]


def _rest(budget: Budget) -> float:
    """Return by how much the model's factor may differ from f within a part."""
    return budget.model_error / (MODEL_PARTS if budget.model_error > 0.0 else 1)


@compiled
def _sums(
    gains: tuple[float, float],
    times: tuple[float, float, float],
    factor: float,
    periods: tuple[int, int],
    kicks: FloatArray,
    answers: FloatArray,
) -> FloatArray:
    """Return the sums of the magnitudes of responses, shape (4, 3), infinite where one does not end.

    An acceleration w within a period acts on the sample after it by (T - t) on e and by 1 on e';
    |h_e (T - t) + h_v| is convex in t, so that its chord is above it.

    Args:
        gains: K_a [1/s^2] and zeta_a [1/s].
        times: T, the time constant of the actuators, and t [s].
        factor: f [-].
        periods: Delay and ``HORIZON`` in periods.
        kicks: Receives the responses to a unit of acceleration within ``MEMORY``, the oldest first, shape (4,
            memory).
        answers: Receives the pull that answers a unit of command, likewise, shape (memory,).
    """
    (T, lag, unseen), (delay, n), memory = times, periods, kicks.shape[1]
    left, in_v, in_x = lag_factors(T, lag)
    e, v, pull = np.zeros((3, n + 1)), np.zeros((3, n + 1)), np.zeros((3, n + 1))
    e[1, 0], v[2, 0] = 1.0, 1.0  # the runs: a unit command, a unit of e and one of e'
    q, sums, quiet, ahead = np.zeros(3), np.zeros((4, 3)), 0, np.zeros((3, n + 1))
    for k in range(n):
        largest = 0.0
        for run in range(3):
            if k >= delay:
                pull[run, k] = -gains[0] * e[run, k - delay] - gains[1] * v[run, k - delay]
            u = pull[run, k] + (1.0 if run == 0 and k == 0 else 0.0)
            gap = q[run] - u
            e[run, k + 1] = e[run, k] + T * v[run, k] + factor * (0.5 * T * T * u + in_x * gap)
            v[run, k + 1] = v[run, k] + factor * (T * u + in_v * gap)
            q[run] = u + left * gap
            largest = max(largest, abs(e[run, k + 1]) + abs(v[run, k + 1]))
            ahead[run, k] = e[run, k] + unseen * v[run, k]
        for i, h in enumerate((e, v, pull, ahead)):
            sums[i, 0] += abs(h[0, k])
            kick = 0.5 * T * (abs(h[1, k] * T + h[2, k]) + abs(h[2, k]))
            sums[i, 1] += kick
            if k >= memory:
                sums[i, 2] += kick
            else:
                kicks[i, memory - 1 - k] = kick
        if 0 < k <= memory:
            answers[memory - k] = pull[0, k]
        quiet = quiet + 1 if largest < LEFT else 0
        if quiet > delay + 1:  # nothing that is measured later differs from this
            return sums
    return np.full((4, 3), np.inf)


# How far the axes of a plan may depart from their nominal motions in one transition, period by period.
#
# The departure e = x - x^ of an axis is the sum of its loop's responses to what enters it, see
# above. In one period this is at most
#
# d = |epsilon| (|a^| + c(w^)) + c(w^ + e'_1) - c(w^) + w + (1 + epsilon - f) q,
#
# with the nominal rates w^ of all axes, and c the largest acceleration that rates alone cause where nothing
# is commanded: robots command what balances it at the nominal rates, with masses that are wrong by epsilon.
# e'_1 is what the first term and w alone cause, w being ``axis_error`` and what the friction of joints
# causes: what noise adds is small and of any sign. All of this is known from the periods before, so that
# one pass forward in time bounds the departures of all axes.

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
        ahead: Largest |e + t e'| at the period's beginning, t being how long nobody may know of a departure
            [rad or m].
        entered: d for every part of the model's range, shape (periods + 1, axes, parts).
    """

    position: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    pull: FloatArray
    ahead: FloatArray
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
    found, state = np.empty((5, samples + 1, axes)), np.concatenate([before.state, before.state[1:]])
    left = lag_factors(budget.period, budget.lag)[0]
    error = axis_errors(budget, loop.tracking, axes)
    scales = _Scales(budget.period, budget.model_error, error, loop.rest, left)
    responses = loop.kicks, loop.sums[:, :, OLD].copy(), loop.noises(axes), loop.errors
    _carry(responses, leaving, scales, coupling, moving, entered, state, found)
    highest = np.maximum.accumulate(entered[..., ::-1], axis=3)[..., ::-1]
    first = min(leaving, samples + 1)
    past = highest[..., first : first + memory].copy()
    of_periods = entered[0, ..., memory:].transpose(2, 1, 0)
    away = Departures(found[0], found[1], found[2], found[3], found[4], of_periods)
    return away, Inflow(past, np.stack([state[0], state[2]]))


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
    even = even_sets(samples, *moving, loop.budget.period)
    found, _ = departing(loop, [even] * axes, coupling, at_rest(loop, axes), samples)
    return Departures(*(one.max(axis=0) for one in found))


def resting_axes(loop: AxisLoop, rest_rate: float) -> FloatArray:
    """Return |e|, |e'|, |e''| and |q| because of a rate with which an axis is taken for resting, shape (4,).

    The rate is there at the beginning, and it was in the measurements, too, that are used in the first m
    periods, with any sign. Constant errors of the position are among those that the loop counts.

    Args:
        loop: The loop of all axes.
        rest_rate: The rate [rad/s or m/s].
    """
    budget, (stiffness, damping) = loop.budget, (loop.tracking.stiffness, loop.tracking.damping)
    T, delay = budget.period, whole_periods(budget.delay, budget.period)
    left, in_v, in_x = lag_factors(T, budget.lag)
    found = np.zeros(4)
    for part, factor in enumerate(loop.factors):
        most = np.zeros(3)
        # The rate at the beginning, then one in each of the measurements that are used first.
        for first in range(1 + delay):
            e, v, q = [0.0] * (delay + 1), [0.0] * (delay + 1), 0.0
            v[-1 - first] = rest_rate
            largest = np.zeros(3)
            if first:
                v[-1] = 0.0
            for _ in range(whole_periods(HORIZON, T)):
                u = -stiffness * e[-1 - delay] - damping * v[-1 - delay]
                largest = np.maximum(largest, np.abs([e[-1], v[-1], u]))
                gap = q - u
                e.append(e[-1] + T * v[-1] + factor * (0.5 * T * T * u + in_x * gap))
                v.append(v[-1] + factor * (T * u + in_v * gap))
                q = u + left * gap
            most += largest
        # The rest of the model's factor acts on this pull, and on what it causes itself.
        sums = loop.sums[part, :, PUSH]
        pull = most[2] / (1.0 - loop.rest * sums[2])
        away, fast = most[:2] + loop.rest * pull * sums[:2]
        push = (1.0 + budget.model_error) * pull
        found = np.maximum(found, [away + 0.125 * T * T * push, fast + T * push, push, pull])
    return found


@compiled(borrows=True)
def _rate_terms(coupling: FloatArray, rates: FloatArray) -> float:
    """Return c, the largest acceleration of one axis because of rates up to these [rad/s^2 or m/s^2]."""
    total = 0.0
    for j in range(rates.size):
        for k in range(j + 1):
            total += coupling[j, k] * rates[j] * rates[k]
    return total


@compiled(reassociate=True, borrows=True)
def _answers(
    kicks: FloatArray, entered: FloatArray, first: FloatArray
) -> tuple[float, float, float, float, float]:
    """Return the sums of the sizes of the responses times what entered, of e, e', the pull and e + t e'.

    The last number is that of e' to ``first`` alone.
    """
    x = v = q = ahead = v_first = 0.0
    for m in range(entered.size):
        x += kicks[0, m] * entered[m]
        v += kicks[1, m] * entered[m]
        q += kicks[2, m] * entered[m]
        ahead += kicks[3, m] * entered[m]
        v_first += kicks[1, m] * first[m]
    return x, v, q, ahead, v_first


_Responses = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""To a unit of acceleration in one period, the oldest first, shape (parts, 4, memory); sums of those that are
older, shape (parts, 4); e, e', the pull and e + t e' that noise causes, shape (axes, parts, 4); largest
|epsilon| of every part."""


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
        found: Receives the departures, shape (5, periods, axes).
    """
    kicks, late, noise, errors = responses
    parts, axes, memory, ever = len(errors), len(coupling), kicks.shape[2], found.shape[1] - 1
    now = np.zeros((5, parts, axes))
    for k in range(ever):
        for p in range(parts):
            for i in range(axes):
                window = entered[:, p, i, k : memory + k]
                x, v, q, ahead, first = _answers(kicks[p], window[0], window[1])
                most = state[0, p, i] = max(state[0, p, i], entered[0, p, i, memory + k - 1])
                now[0, p, i] = noise[i, p, 0] + x + late[p, 0] * most
                now[1, p, i] = noise[i, p, 1] + v + late[p, 1] * most
                pull = noise[i, p, 2] + q + late[p, 2] * most
                now[2, p, i] = max(pull, state[1, p, i])
                now[3, p, i] = first + late[p, 1] * most
                now[4, p, i] = noise[i, p, AHEAD] + ahead + late[p, AHEAD] * most
                state[1, p, i] = pull + scales.left * max(state[1, p, i] - pull, 0.0)
                if k >= leaving:
                    state[2, p, i] = max(state[2, p, i], now[2, p, i])
        _enter(now, moving[:, k], (coupling, errors), scales, found[:, k], entered[:, :, :, memory + k])
        for p in range(parts if k > 0 else 0):  # A period ends where the next one begins.
            for i in range(axes):
                found[0, k - 1, i] = max(found[0, k - 1, i], now[0, p, i])
    _settle(responses, coupling, scales, moving[:, ever], entered, state, found)
    found[0, ever - 1] = np.maximum(found[0, ever - 1], found[0, ever])


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
        now: Largest |e| and |e'| at its beginning, largest |q| in it, e'_1 and |e + t e'| at its beginning,
            shape (5, parts, axes).
        moving: Largest |x^''| and |x^'| in it, shape (2, axes).
        model: Coefficients of c, and the largest |epsilon| of every part.
        scales: What all axes share.
        found: Receives |e|, |e'|, |e''|, |q| and |e + t e'|, shape (5, axes).
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
            found[3, i], found[4, i] = max(found[3, i], now[2, p, i]), max(found[4, i], now[4, p, i])


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
    now, most, flowing = np.zeros((5, parts, axes)), np.zeros((2, parts, axes)), np.zeros((2, parts, axes))
    for j in range(2):
        for p in range(parts):
            for i in range(axes):
                most[j, p, i] = entered[j, p, i, ever : memory + ever].max()
    for _ in range(ATTEMPTS):
        for p in range(parts):
            for i in range(axes):
                state[0, p, i] = max(state[0, p, i], most[0, p, i])
                for j, to, by in ((0, AWAY, 0), (1, FAST, 0), (2, PULL, 0), (3, FAST, 1), (4, AHEAD, 0)):
                    caused = kicks[p, to].sum() * most[by, p, i] + late[p, to] * state[0, p, i]
                    now[j, p, i] = caused + (0.0 if by else noise[i, p, to])
                now[2, p, i] = max(now[2, p, i], state[1, p, i])
        _enter(now, moving, (coupling, errors), scales, found[:, ever], flowing)
        if (flowing <= most).all():
            break
        most = np.maximum(most, GROWTH * flowing)
    else:
        found[:, ever] = np.inf
    entered[:, :, :, memory + ever] = most
    state[2] = np.maximum(state[2], now[2])
