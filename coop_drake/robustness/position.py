"""How far the object's origin may depart from its nominal motion under a budget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
from scipy.linalg import expm

from coop_drake.answers.budget import Budget, PositionTube
from coop_drake.jit import compiled
from coop_drake.laws.measurements import whole_periods
from coop_drake.robustness.alarms import unseen_of
from coop_drake.tree.arrays import FloatArray

MODEL_PARTS = 10
"""Parts into which the range of the model's error is cut [-]; within each only the rest is a disturbance."""

HORIZON = 6.0
"""Responses are summed for so long [s]; what is left of them then must be below ``LEFT``."""

LEFT = 1e-9
"""Responses to a unit input are followed until they are below this [-]; a loop in which they stay above it
for ``HORIZON`` is refused."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than the responses after
``HORIZON`` and another way to round need."""

E, V, S, Q, R = range(5)
"""State: e [m], e' [m/s], s [m/s^2], p^ - p_G [m], p^' [m/s]; then older e, e' for a delay."""


ROUNDED = 1e-7
"""What may be left of responses after the horizon [m, m/s, m/s^2]."""

AHEAD = 6
"""Row of e + t e' among responses."""

Loop = tuple[float, float, float, float]
"""K, zeta, K_t and zeta_t."""


@dataclass(frozen=True)
class PositionGains:
    """Gains of the position's loop.

    Attributes:
        stiffness: K of the nominal motion [1/s^2].
        damping: zeta of the nominal motion [1/s].
        tracking_stiffness: K_t [1/s^2].
        tracking_damping: zeta_t [1/s].
        speed: Largest speed of p_G [m/s].
    """

    stiffness: float
    damping: float
    tracking_stiffness: float
    tracking_damping: float
    speed: float

    @property
    def loop(self) -> Loop:
        """All but the speed, on which the loop's responses do not depend."""
        return self.stiffness, self.damping, self.tracking_stiffness, self.tracking_damping


def position_bounds(gains: Sequence[PositionGains], budget: Budget) -> list[FloatArray | None]:
    """Return the least bounds of each choice of gains under a budget, None where the loop is not stable.

    Args:
        gains: The choices.
        budget: The departures to be tolerated.

    Returns:
        Of each radius, rate, velocity, rest, acceleration and what is ahead, as in a tube, shape (6,).
    """
    worst: list[FloatArray | None] = [np.zeros(6) for _ in gains]
    for error in position_errors(budget):
        sums = {loop: _sums_of(loop, budget, error) for loop in dict.fromkeys(own.loop for own in gains)}
        for i, own in enumerate(gains):
            before, found = worst[i], _bounds(own, budget, sums[own.loop], error)
            worst[i] = None if before is None or found is None else np.maximum(before, found)
    return worst


def position_tubes(gains: Sequence[PositionGains], budget: Budget) -> list[PositionTube | None]:
    """Return the tube of each choice of gains under a budget, None where the loop is not stable."""
    return [
        None if bounds is None else _stated(own, bounds)
        for own, bounds in zip(gains, position_bounds(gains, budget), strict=True)
    ]


def position_errors(budget: Budget) -> list[float]:
    """Return the middles of the parts of the model's range [-]."""
    parts = MODEL_PARTS if budget.model_error > 0.0 else 1
    return [budget.model_error * ((2 * part + 1) / parts - 1.0) for part in range(parts)]


def _stated(gains: PositionGains, bounds: FloatArray) -> PositionTube:
    loop = gains.tracking_stiffness, gains.tracking_damping, gains.speed
    return PositionTube(*loop, *(float((1.0 + SLACK) * value) for value in bounds))


def _bounds(gains: PositionGains, budget: Budget, sums: FloatArray | None, error: float) -> FloatArray | None:
    """Return radius, rate, velocity, rest, acceleration, what is ahead, (6,), from sums of responses (7, 3).

    Part of the error of the model is a disturbance of at most ``rest`` times the command itself, which the
    command's bound must allow for. A step of p_G moves the nominal acceleration and then the feedback, whose
    sum is the command: their responses are added with their signs before their sizes are summed.
    """
    rest = budget.model_error / len(position_errors(budget))
    if sums is None or rest * sums[2, 1] >= 1.0:
        return None
    noise = gains.tracking_stiffness * budget.position_noise + gains.tracking_damping * budget.velocity_noise
    moving = _with_clocks(gains, budget, sums, rest, gains.speed)
    still = _with_clocks(gains, budget, sums, rest, 0.0)
    if moving is None or still is None:
        return None
    radius, rate, velocity, command, acceleration, ahead = moving
    between = budget.period**2 / 8.0 * (acceleration + gains.speed * sums[3, 2])
    own = (1.0 + error + rest) * (command + (budget.single_noise - 1.0) * noise)
    return np.array([radius + between, rate, velocity, still[0] + between, own, ahead])


def _with_clocks(
    gains: PositionGains, budget: Budget, sums: FloatArray, rest: float, speed: float
) -> FloatArray | None:
    """Return bounds of e at samples, e', p', the command, p'' and e + t e', shape (6,), for a speed of p_G.

    They grow with what noise adds to a command, and where ages are wrong this grows with |p'| and |p''|; None
    where there is no end to it.
    """
    T, nominal, stiff, damped = (
        budget.period,
        speed * sums[3, 2],
        gains.tracking_stiffness,
        gains.tracking_damping,
    )

    def caused(noise: float) -> FloatArray:
        moving = noise * sums[:, 0] + budget.acceleration_error * sums[:, 1] + speed * sums[:, 2]
        led = noise * (1.0 + sums[2, 0]) + budget.acceleration_error * sums[2, 1] + speed * sums[5, 2]
        command = led / (1.0 - rest * sums[2, 1])
        away, rate, ahead = (moving + rest * command * sums[:, 1])[[E, V, AHEAD]]
        acceleration = (1.0 + budget.model_error) * command + budget.acceleration_error
        rate += T / 2.0 * (acceleration + nominal)
        velocity = speed * sums[4, 2] + rate + T / 2.0 * nominal
        return np.array([away, rate, velocity, command, acceleration, ahead])

    def mistaken(found: FloatArray) -> float:
        return budget.age_error * float(stiff * found[2] + damped * found[4])

    noise = stiff * budget.position_noise + damped * budget.velocity_noise
    if not budget.age_error:
        return caused(noise)
    least = mistaken(caused(0.0))
    grows = mistaken(caused(1.0)) - least
    return caused((noise + least) / (1.0 - grows)) if grows < 1.0 else None


def _sums_of(loop: Loop, budget: Budget, error: float) -> FloatArray | None:
    """Return ``response_sums`` of a loop with one error of the model; None where it is not stable."""
    T, delay = budget.period, whole_periods(budget.delay, budget.period)
    parts = position_loop(loop, T, delay, budget.lag, error)
    sums, left = response_sums(T, unseen_of(budget), *parts, ceil(HORIZON / T))
    return sums if left < LEFT else None


@compiled
def response_sums(
    T: float,
    unseen: float,
    matrix: FloatArray,
    held: FloatArray,
    feedback: FloatArray,
    nominal: FloatArray,
    samples: int,
) -> tuple[FloatArray, float]:
    """Return the sums of |h|, shape (7, 3), and the largest response that is left.

    Rows: e, e', feedback, nominal acceleration, p^', sum of feedback and nominal acceleration, and e + t e'.
    Columns: for a unit of command in each period, for a unit of acceleration w, of speed of p_G. A
    disturbance w within a period acts on the sample after it by (T - t) on e and by 1 on e'; |h_e (T - t) +
    h_v| is convex in t, so that its chord is above it.

    Args:
        T: Control period [s].
        unseen: t [s].
        matrix: Of one period, see ``position_loop``, shape (5 + 2 delay, 5 + 2 delay); so are the others.
        held: Response to a unit command held for a period, shape (5 + 2 delay,).
        feedback: What the state adds to the command, shape (5 + 2 delay,).
        nominal: The nominal acceleration, shape (5 + 2 delay,).
        samples: Largest number of samples.
    """
    size = len(held)
    state, after = np.zeros((size, 4)), np.zeros((size, 4))
    state[:, 0], state[V, 1], state[E, 2], state[Q, 3] = held, 1.0, 1.0, -1.0
    sums, h, left = np.zeros((7, 3)), np.zeros((7, 4)), np.inf
    for _ in range(samples):
        h[0], h[1], h[4], h[AHEAD] = state[E], state[V], state[R], state[E] + unseen * state[V]
        h[2:4] = 0.0
        for i in range(size):
            for c in range(4):
                h[2, c] += feedback[i] * state[i, c]
                h[3, c] += nominal[i] * state[i, c]
        h[5] = h[2] + h[3]
        for i in range(7):
            sums[i, 0] += abs(h[i, 0])
            sums[i, 1] += 0.5 * T * (abs(h[i, 2] * T + h[i, 1]) + abs(h[i, 1]))
            sums[i, 2] += T * abs(h[i, 3])
        left = 0.0
        for i in range(size):
            for c in range(4):
                value = 0.0
                for j in range(size):
                    value += matrix[i, j] * state[j, c]
                after[i, c] = value
                left = max(left, abs(value))
        state, after = after, state
        if left < LEFT:
            break
    return sums, left


def position_loop(
    loop: Loop, T: float, delay: int, lag: float, error: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the matrix of one period, the response to a unit command held for it, and two rows.

    The rows give what e adds to the command, and the nominal acceleration.
    """
    stiffness, damping, tracking_stiffness, tracking_damping = loop
    flow, size = _flow(stiffness, damping, T, lag, error), 5 + 2 * delay
    feedback, nominal, held = np.zeros(size), np.zeros(size), np.zeros(size)
    nominal[[Q, R]] = -stiffness, -damping
    oldest = 5 + 2 * (delay - 1) if delay else E
    feedback[[oldest, oldest + 1]] = -tracking_stiffness, -tracking_damping
    held[:5] = flow[:5, 5]
    matrix = np.outer(held, feedback + nominal)
    matrix[:5, :5] += flow[:5, :5]
    for i in range(2 * delay):  # e, e' of one period before, then those of two, and so on
        matrix[5 + i, i if i < 2 else 5 + i - 2] = 1.0
    return matrix, held, feedback, nominal


@lru_cache(maxsize=2 * MODEL_PARTS)
def _flow(stiffness: float, damping: float, T: float, lag: float, error: float) -> FloatArray:
    """Return the matrix of one period without feedback, shape (6, 6); the last state is the held command."""
    motion = np.zeros((6, 6))
    motion[E, V] = motion[Q, R] = 1.0
    motion[V, Q], motion[V, R] = stiffness, damping
    motion[R, Q], motion[R, R] = -stiffness, -damping
    if lag > 0.0:
        motion[V, S], motion[S, S], motion[S, 5] = 1.0 + error, -1.0 / lag, 1.0 / lag
    else:
        motion[V, 5] = 1.0 + error
    flow: FloatArray = expm(T * motion)
    return flow


def position_may_rest(
    tube: PositionTube, governor: tuple[float, float], budget: Budget, rest_rate: float
) -> bool:
    """Whether a tube holds for an object that is taken for resting with a small rate, too.

    Nothing entered the loop before the rest, of which the tube counts errors at all times.

    With g the response to a unit of e' at the beginning, and h and h_w those to a unit of command and of
    acceleration in one period, this is so if at every sample k, for e, e' and the feedback,

        rest_rate (|g(k)| + zeta_t sum over i < m of |h(k - i)|)
            <= sum over j > k of (zeta_t n_v |h(j)| + w |h_w(j)|),

    for a rest that is off by n_p takes its part K_t n_p of what the tube counts.

    Args:
        tube: The tube.
        governor: K [1/s^2] and zeta [1/s] of the nominal motion.
        budget: The budget.
        rest_rate: The rate [m/s].
    """
    T, delay = budget.period, whole_periods(budget.delay, budget.period)
    tracking = tube.tracking_stiffness, tube.tracking_damping
    for error in position_errors(budget):
        loop = position_loop((*governor, *tracking), T, delay, budget.lag, error)
        command, rate, place = _responses(*loop[:3], whole_periods(HORIZON, T))
        pushed = 0.5 * T * (np.abs(place * T + rate) + np.abs(rate))
        entered = tracking[1] * budget.velocity_noise * np.abs(command)
        left = (entered + budget.acceleration_error * pushed)[::-1].cumsum(axis=0)[::-1]
        seen = np.abs(rate)
        for i in range(delay):
            seen[i:] += tracking[1] * np.abs(command[: len(command) - i])
        caused = rest_rate * seen
        if not (caused[:-1] <= left[1:] + ROUNDED).all():
            return False
    return True


def _responses(
    matrix: FloatArray, held: FloatArray, feedback: FloatArray, samples: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return e, e' and the feedback after a unit of command, of e' and of e, each of shape (samples, 3)."""
    state = np.zeros((len(held), 3))
    state[:, 0], state[V, 1], state[E, 2] = held, 1.0, 1.0
    found = np.empty((samples, 3, 3))
    for k in range(samples):
        found[k] = state[E], state[V], feedback @ state
        state = matrix @ state
    return found[..., 0], found[..., 1], found[..., 2]
