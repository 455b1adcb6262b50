"""Tubes of the nominal motions of many axes at once, from the entry sets that a plan states.

The state (x, v, a) of an axis, a being its acceleration, is carried over a period by a matrix. Departures are
superposed as the planner does, with all responses of all axes in one array.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.axis_law import Axes, fit

LATE = 1
"""Periods for which the command of the cell before acts after a switch [-]."""


@dataclass(frozen=True)
class Nominal:
    """Nominal motions of b axes.

    Attributes:
        axes: The axes.
        period: Control period [s].
        lag: Time constant of the actuators [s].
    """

    axes: Axes
    period: float
    lag: float

    @property
    def carry(self) -> tuple[FloatArray, FloatArray]:
        """The matrix that carries (x, v, a) over a period, and the vector by which the command enters."""
        T, lag = self.period, self.lag
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
        return L, slope, by_rate, rest, np.abs(L) + np.abs(slope) * reach + np.abs(by_rate) * fast + rest


def tubes(
    motions: Nominal,
    samples: int,
    middle: FloatArray,
    reach: FloatArray,
    before: FloatArray,
    rest: FloatArray,
) -> FloatArray:
    """Return the tubes of all axes, shape (samples, 8, b).

    Args:
        motions: The axes.
        samples: Number of samples.
        middle: Middle of x and of v at the entry, shape (2, b).
        reach: How far they depart from it, shape (2, b).
        before: Largest |acceleration| and |command| at the entry, shape (b,) [rad/s^2 or m/s^2].
        rest: Where the axes rest when they are handed over, shape (b,).

    Returns:
        Per sample x, its reach, v, its reach, the largest |acceleration|, the distance to the bounds, the
        command and its reach.
    """
    T, count = motions.period, middle.shape[1]
    matrix, enters = motions.carry
    responses, weight = np.zeros((3, samples + 3, count)), np.zeros((samples + 3, count))
    responses[:, :3], weight[:3] = np.eye(3)[:, :, None], [*reach, before]
    now, away = np.array([*middle, np.zeros(count)]), np.array([*reach, before])
    nothing = np.zeros(count)
    jump = -motions.command(0.0, rest, nothing, nothing, nothing)[0]
    made = np.empty((samples, 8, count))
    for k in range(samples):
        u, slope, by_rate, size, most = motions.command(k * T, now[0], away[0], now[1], away[1])
        faded = motions.axes.left(k * T) * jump
        most, u = most - np.abs(u) + np.abs(u + faded), u + faded
        if k < LATE:
            size = most = np.maximum(most, before)
            u, slope, by_rate = nothing, nothing, nothing
        weight[3 + k] = size
        fastest = np.maximum(np.abs(now[2]) + away[2], most)
        made[k, :5] = now[0], away[0], now[1], away[1], fastest
        made[k, 5:] = _distance(motions, k, now, away, fastest), u, most - np.abs(u)
        used = responses[:, : 4 + k]
        answer = slope * used[0] + by_rate * used[1]
        answer[3 + k] = 1.0
        responses[:, : 4 + k] = np.tensordot(matrix, used, 1) + enters[:, None, None] * answer
        now = matrix @ now + enters[:, None] * u
        away = np.einsum("ijk,jk->ik", np.abs(responses[:, : 4 + k]), weight[: 4 + k])
    return made


def _distance(motions: Nominal, k: int, now: FloatArray, away: FloatArray, fastest: FloatArray) -> FloatArray:
    T = motions.period
    (low, high), _, bent = motions.axes.bounds(k * T)
    later = motions.axes.bounds((k + 1) * T)[2]
    bend = np.abs(np.stack([bent, later])).max(axis=(0, 1))
    inside = np.minimum(now[0] - away[0] - low, high - now[0] - away[0])
    result: FloatArray = inside - 0.125 * T * T * (fastest + bend)
    return result
