"""How far axes may depart from their nominal motions under a budget, for the gains that a plan states.

The departure e of an axis obeys e'' = (1 + epsilon) q + epsilon (a + c) + w, a being the acceleration of its
nominal motion, c that which the nominal rates of all axes cause by themselves, and q the pull -K e - zeta e'
of a delayed, noisy, sampled and lagging loop. Where the factor 1 + epsilon is f + d, with |d| at most a part
of the model's error, the loop e'' = f q is linear and known: e is the sum of its responses to every period.
"""

from __future__ import annotations

from collections import deque
from math import ceil, exp
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.position_loop import carried, mean_size

PARTS = 5
"""Parts into which the range of the model's error is cut [-]."""

HORIZON = 4.0
"""Responses are summed for so long [s]."""

LEFT = 1e-7
"""What may be left of a unit response after that [rad or m, rad/s or m/s]."""

RECENT = 0.3
"""What entered longer ago counts with its largest size in the whole plan [s]."""

ROUNDS = 60
"""Largest number of enlarged bounds that are tried for what stays for ever [-]."""


class Loop(NamedTuple):
    """The loop that pulls axes to their nominal motions; p parts of the model's range.

    Attributes:
        budget: The budget.
        recent: Sizes of the responses of e, e' and q to a unit of acceleration in one period, the oldest
            first, shape (p, memory, 3).
        old: Sums of those that are older, shape (p, 3).
        noise: What noise causes of e, e' and the pull, of every axis or of all, shape (p, axes or 1, 3).
        pushes: Largest |w| of every axis, or of all, shape (axes or 1,) [rad/s^2 or m/s^2].
        direct: What it adds to a command at once [rad/s^2 or m/s^2].
        factors: f of every part, shape (p,).
        answers: Pull after a unit of command in one period, from the period after it on, shape (p, samples).
        errors: Largest |epsilon| of every part, shape (p, 1).
        spread: Largest |d| [-].
        started: Largest |e|, |e'| and |q| at all times after a unit of e' at the beginning, and in all
            measurements that are used first, with any sign, shape (p, 3).
    """

    budget: Budget
    recent: FloatArray
    old: FloatArray
    noise: FloatArray
    pushes: FloatArray
    direct: float
    factors: FloatArray
    answers: FloatArray
    errors: FloatArray
    spread: float
    started: FloatArray


class Entered(NamedTuple):
    """What entered the loops before a cell is entered.

    Attributes:
        recent: Of the periods before, the latest last: the largest acceleration, and the part of it that
            counts for the rates of other axes' terms, shape (2, p, axes, memory).
        largest: The largest one at all earlier times, shape (p, axes).
        lagging: The largest lagging pull, shape (p, axes).
    """

    recent: FloatArray
    largest: FloatArray
    lagging: FloatArray


def loop_of(tracking: AxisTracking, budget: Budget) -> Loop:
    """Return the loop of a plan's gains.

    Raises:
        RefusalError: The loop does not come to rest.
    """
    T, delay = budget.period, ceil(budget.delay / budget.period - 1e-9)
    parts, memory = PARTS if budget.model_error > 0.0 else 1, ceil(RECENT / budget.period - 1e-9)
    spread = budget.model_error / parts
    errors = budget.model_error * (np.arange(1, 2 * parts, 2) / parts - 1.0)
    e, v, a = np.zeros((3, 3, parts))  # runs: a command, a rate, a place
    v[1], e[2] = 1.0, 1.0
    past = deque([(0.0 * e, 0.0 * v)] * delay, maxlen=delay + 1)
    command, started, largest, sizes, pulls = *np.zeros((3, 3, parts)), [], []
    for k in range(ceil(HORIZON / T)):
        past.append((e, v))
        pull = -tracking.stiffness * past[0][0] - tracking.damping * past[0][1]
        found = np.array([e, v, pull])
        command += np.abs(found[:, 0])
        started = np.maximum(started, np.abs(found[:, 1]))
        largest = np.maximum(largest, np.abs(found[:, 0]) if k else np.array([0.0, 0.0, 1.0])[:, None])
        pulls.append(pull[0].copy())
        sizes.append(T * mean_size(found[:, 1], found[:, 1] + T * found[:, 2]))
        if k == 0:
            pull[0] += 1.0
        e, v, a = carried(e, v, a, pull, 1.0 + errors, budget.lag, T)
    if not max(np.abs(e).max(), np.abs(v).max()) < LEFT:
        raise RefusalError("axis_tracking", f"the axes have not come to rest after {HORIZON} s")
    kicks = np.array(sizes).transpose(2, 0, 1)
    if not (spread * kicks[:, :, 2].sum(axis=1) < 1.0).all():
        raise RefusalError("axis_tracking", "the error of the model may exceed what the loop makes up for")
    x, v = mistaken(tracking, budget)
    size = tracking.stiffness * (budget.angle_noise + x) + tracking.damping * (budget.rate_noise + v)
    noise = size[:, None] * (command.T + np.array([0.0, 0.0, 1.0]))[:, None]
    recent = np.ascontiguousarray(kicks[:, :memory][:, ::-1])
    return Loop(
        budget,
        recent,
        kicks[:, memory:].sum(axis=1),
        noise,
        budget.axis_acceleration_error + np.array(tracking.disturbance[1:] or (0.0,)),
        tracking.stiffness * budget.angle_noise + tracking.damping * budget.rate_noise,
        1.0 + errors,
        np.array(pulls[1:]).T,
        np.abs(errors)[:, None] + spread,
        spread,
        (started + tracking.damping * delay * largest).T,
    )


def mistaken(tracking: AxisTracking, budget: Budget) -> FloatArray:
    """Return what wrong ages make of measured axes and of their rates, (2, axes), or (2, 1) for nothing.

    What a robot takes for the state at an instant was so up to twice its clock's error before or after it.
    """
    if not budget.clock_error:
        return np.zeros((2, 1))
    return 2.0 * budget.clock_error * np.array([tracking.rate, tracking.acceleration])


def resting(loop: Loop, axes: int) -> Entered:
    """Return what entered the loops of axes that rest at the plan's start."""
    parts, memory, _ = loop.recent.shape
    error = np.empty((2, parts, axes, memory))
    error[:] = loop.pushes[:, None]
    return Entered(error, error[0, :, :, 0], 0.0 * error[0, :, :, 0])


def departures(
    loop: Loop, coupling: FloatArray, moving: FloatArray, before: Entered, leaving: int
) -> tuple[FloatArray, Entered, FloatArray]:
    """Return how far axes depart in every period of a transition, and what enters before the next one.

    Args:
        loop: The loop of all axes.
        coupling: Largest coefficients c_ijk of c, shape (axes, axes, axes).
        moving: Largest |a| and rate in every period of the nominal motion, the last one for ever, shape
            (periods + 1, 2, axes).
        before: What entered before.
        leaving: The first sample at which the cell can be left.

    Returns:
        Largest |e|, |e'|, |e''| and |q|, shape (periods + 1, 4, axes), the last one for ever; what entered
        before the next one; and the largest acceleration that entered in every period, likewise, shape (p,
        axes, periods + 1).
    """
    T, memory, ever = loop.budget.period, loop.recent.shape[1], len(moving) - 1
    entered = np.concatenate([before.recent, np.empty((*before.recent.shape[:3], ever + 1))], axis=3)
    largest, lagging, kept = before.largest.copy(), before.lagging.copy(), before.lagging.copy()
    gone = exp(-T / loop.budget.lag) if loop.budget.lag > 0.0 else 0.0
    found = np.empty((ever + 1, 4, moving.shape[2]))
    for k in range(ever):
        answers = entered[..., k : memory + k] @ loop.recent
        largest = np.maximum(largest, entered[0, :, :, memory + k - 1])
        state, pulled = _state(loop, answers, largest, lagging)
        found[k], entered[..., memory + k] = _period(loop, coupling, moving[k], state)
        if k > 0:
            found[k - 1, 0] = np.maximum(found[k - 1, 0], state[0].max(axis=0))
        lagging = pulled + gone * np.maximum(lagging - pulled, 0.0)
        kept = np.maximum(kept, state[2]) if k >= leaving else kept
    most, total = entered[..., ever : memory + ever].max(axis=3), loop.recent.sum(axis=1)[:, None]
    for _ in range(ROUNDS):
        largest = np.maximum(largest, most[0])
        state, _ = _state(loop, most[..., None] * total, largest, lagging)
        found[ever], flows = _period(loop, coupling, moving[ever], state)
        if (flows <= most).all():
            break
        most = np.maximum(most, 1.005 * flows)
    else:
        found[ever] = np.inf
    found[ever - 1, 0] = np.maximum(found[ever - 1, 0], found[ever, 0])
    entered[..., memory + ever] = most
    ends = np.flip(np.maximum.accumulate(np.flip(entered, 3), axis=3), 3)
    first = min(leaving, ever + 1)
    following = Entered(ends[..., first : first + memory], largest, np.maximum(kept, state[2]))
    return found, following, entered[0, ..., memory:]


def _state(
    loop: Loop, answers: FloatArray, largest: FloatArray, lagging: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return |e|, |e'|, the lagging pull and the rate that others' terms see, (4, p, axes), and the pull."""
    old = largest[..., None] * loop.old[:, None]
    whole = loop.noise + answers[0] + old
    seen = answers[1, :, :, 1] + old[..., 1]
    pulled = whole[..., 2]
    return np.stack([whole[..., 0], whole[..., 1], np.maximum(pulled, lagging), seen]), pulled


def _period(
    loop: Loop, coupling: FloatArray, moving: FloatArray, state: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return |e|, |e'|, |e''| and |q| in one period, (4, axes), and what enters in it, (2, p, axes)."""
    T, (fastest, rates) = loop.budget.period, moving
    terms = _terms(coupling, rates)
    own = loop.errors * (fastest + terms) + loop.pushes
    more = _terms(coupling, rates + (state[3] + T * own).max(axis=0)) - terms
    push = (1.0 + loop.budget.model_error) * state[2] + own + more
    found = np.stack([state[0] + T * T / 8.0 * push, state[1] + T * push, push, state[2]]).max(axis=1)
    return found, np.stack([own + more + loop.spread * state[2], own])


def _terms(coupling: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the largest accelerations that rates cause by themselves, shape (axes,)."""
    terms: FloatArray = coupling @ rates @ rates
    return terms
