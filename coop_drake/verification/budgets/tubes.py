"""Tubes of many axes at once, and the sets in which they stay, from the entry sets that a plan states.

The state (x, v, a) of an axis, a being its acceleration, is carried over a period by a matrix; the command
follows from the state some periods ago. Departures are superposed as the planner does, with all responses
of all axes in one array.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, exp

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.axis_law import Axes, fit

LATE = 1
"""Periods for which the command of the cell before acts after a switch [-]."""


@dataclass(frozen=True)
class Disturbed:
    """Axes with what disturbs them: a budget, and the factor of their model, each shape (b,).

    Attributes:
        axes: The axes.
        budget: The budget.
        factor: Factor by which accelerations are larger than commanded [-].
        error: By how much that factor may differ [-].
    """

    axes: Axes
    budget: Budget
    factor: FloatArray
    error: FloatArray

    @property
    def delay(self) -> int:
        """Age of a measurement in whole periods [-]."""
        return ceil(self.budget.delay / self.budget.period - 1e-9)

    @property
    def carry(self) -> tuple[FloatArray, FloatArray]:
        """The matrix that carries (x, v, a) over a period, and the vector by which the command enters."""
        T, lag = self.budget.period, self.budget.lag
        left = exp(-T / lag) if lag > 0.0 else 0.0
        in_v = lag * (1.0 - left)
        in_x = lag * (T - in_v)
        matrix = np.array([[1.0, T, in_x], [0.0, 1.0, in_v], [0.0, 0.0, left]])
        return matrix, np.array([0.5 * T * T - in_x, T - in_v, 1.0 - left])

    def command(
        self, time: float | FloatArray, x: FloatArray, reach: FloatArray, v: FloatArray, fast: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Return the command at (x, v), its linear approximation, and bounds for all states near it.

        The states are all positions within ``reach`` of x and all rates within ``fast`` of v; units are those
        of ``fit``.

        Returns:
            The command, its slopes by position and by rate, the largest remainder, and the largest |command|,
            each of shape (b,).
        """
        L, slope, by_rate, rest, spread = fit(self.axes, time, x, reach, v)
        rest = rest + spread * fast
        most = np.abs(L) + np.abs(slope) * reach + np.abs(by_rate) * fast + rest
        return tuple(self.factor * value for value in (L, slope, by_rate, rest, most))

    def errors(self, most: FloatArray) -> FloatArray:
        """Return the largest error of the acceleration under commands up to ``most`` [rad/s^2 or m/s^2]."""
        return self.error / self.factor * most + self.budget.acceleration_error


def tubes(
    disturbed: Disturbed,
    samples: int,
    middle: FloatArray,
    reach: FloatArray,
    before: FloatArray,
    rest: FloatArray,
) -> FloatArray:
    """Return the tubes of all axes, shape (samples, 6, b).

    Args:
        disturbed: The axes.
        samples: Number of samples.
        middle: Middle of x and of v at the entry, shape (2, b).
        reach: How far they depart from it, shape (2, b).
        before: Largest |command| at the entry, and largest |acceleration| before it, shape (2, b).
        rest: Where the axes rest when they are handed over, shape (b,).

    Returns:
        Per sample x, its reach, v, its reach, the largest |acceleration|, and the distance to the bounds.
    """
    T, delay, count = disturbed.budget.period, disturbed.delay, middle.shape[1]
    matrix, enters = disturbed.carry
    past = [np.zeros((3, samples + 3, count)) for _ in range(delay + 1)]  # the oldest state first
    nominal, reaches = [], []
    for q in range(delay, -1, -1):
        state = past[delay - q]
        state[0, samples], state[0, samples + 1], state[1, samples + 1] = 1.0, -q * T, 1.0
        nominal.append(np.array([middle[0] - q * T * middle[1], middle[1], np.zeros(count)]))
        reaches.append(np.array([reach[0] + q * T * reach[1], reach[1], before[0]]))
    past[-1][2, samples + 2] = 1.0
    weight = np.zeros((samples + 3, count))
    weight[samples:] = *reach, before[0]
    nothing = np.zeros(count)
    jump = -disturbed.command(0.0, rest, nothing, nothing, nothing)[0]
    made = np.empty((samples, 6, count))
    for k in range(samples):
        ago = max(delay - k, 0) * T
        x_noise = disturbed.budget.angle_noise + 0.5 * ago * ago * before[1]
        v_noise = disturbed.budget.rate_noise + ago * before[1]
        seen, off = nominal[k], reaches[k]
        u, slope, by_rate, rest, most = disturbed.command(
            k * T, seen[0], off[0] + x_noise, seen[1], off[1] + v_noise
        )
        size = np.abs(slope) * x_noise + np.abs(by_rate) * v_noise + rest
        faded = disturbed.axes.left(k * T) * jump
        most, u = most - np.abs(u) + np.abs(u + faded), u + faded
        if k < LATE:
            size = most = np.maximum(most, before[0])
            u, slope, by_rate = np.zeros(count), np.zeros(count), np.zeros(count)
        weight[k] = size + disturbed.errors(most)
        now, away = nominal[-1], reaches[-1]
        fastest = np.maximum(np.abs(now[2]) + away[2], most + disturbed.errors(most))
        made[k] = now[0], away[0], now[1], away[1], fastest, _distance(disturbed, k, now, away, fastest)
        used = np.r_[: k + 1, samples : samples + 3]
        old, state = past[0], past[-1]
        response = slope * old[0, used] + by_rate * old[1, used]
        response[k] = 1.0
        carried = np.zeros_like(state)
        carried[:, used] = np.tensordot(matrix, state[:, used], 1) + enters[:, None, None] * response
        past = [*past[1:], carried]
        nominal.append(matrix @ now + enters[:, None] * u)
        reaches.append(np.einsum("ijk,jk->ik", np.abs(carried[:, used]), weight[used]))
    return made


def _distance(
    disturbed: Disturbed, k: int, now: FloatArray, away: FloatArray, fastest: FloatArray
) -> FloatArray:
    T = disturbed.budget.period
    (low, high), _, bent = disturbed.axes.bounds(k * T)
    later = disturbed.axes.bounds((k + 1) * T)[2]
    bend = np.abs(np.stack([bent, later])).max(axis=(0, 1))
    inside = np.minimum(now[0] - away[0] - low, high - now[0] - away[0])
    result: FloatArray = inside - 0.125 * T * T * (fastest + bend)
    return result
