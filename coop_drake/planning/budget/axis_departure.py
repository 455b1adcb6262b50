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

from dataclasses import dataclass
from functools import lru_cache
from math import inf

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget
from coop_drake.jit import compiled
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.nominal import lag_factors
from coop_drake.planning.budget.alarms import axis_errors, mistaken
from coop_drake.tree.pose import FloatArray

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

STIFFNESSES = (100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 500.0, 700.0, 1000.0)
"""K_a that are tried [1/s^2]; the narrowest tube is taken."""

DAMPINGS = (1.2, 1.4, 1.7, 2.0, 2.5)
"""zeta_a over the root of K_a that are tried [-]."""

TYPICAL_ACCELERATION = 8.0
"""Acceleration of a nominal motion for which the gains are chosen [rad/s^2 or m/s^2]: two thirds of the
largest one of a funnel's bound in the shipped rule of gains."""

RATE_WEIGHT = 0.01
"""What a departure of the rate counts beside one of the axis, where gains are chosen [s]: it takes its part
of the limit of the rate."""

COMMAND_WEIGHTS = (0.0005, 0.004)
"""What noise in a command counts beside a departure of the axis, where efforts are limited [s^2]: for stiff
loops, as an axis with little room needs them, and for soft ones, which take small efforts."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than the responses after
``HORIZON`` and another way to round need."""

X, V, Q = range(3)
"""What responds: e [rad or m], e' [rad/s or m/s] and the pull [rad/s^2 or m/s^2]."""

COMMAND, ACCELERATION, LATE = range(3)
"""To what: a unit of command in each period, a unit of acceleration, and one from before ``MEMORY``."""


@dataclass(frozen=True)
class AxisLoop:
    """The loop of all axes under a budget.

    Attributes:
        tracking: Its gains.
        budget: The departures to be tolerated.
        sums: Of every part of the model's range the sums of responses, shape (parts, 3, 3).
        kicks: Responses to a unit of acceleration in one period within ``MEMORY``, the oldest first, shape
            (parts, 3, memory).
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
        """Return what noise causes of x [rad or m], x' [rad/s or m/s] and the pull, (axes, parts, 3)."""
        wrong = np.array([[self.budget.angle_noise], [self.budget.rate_noise]])
        wrong = wrong + mistaken(self.budget, self.tracking, axes)
        noise = self.tracking.stiffness * wrong[0] + self.tracking.damping * wrong[1]
        caused: FloatArray = noise[:, None, None] * (self.sums[:, :, COMMAND] + [0.0, 0.0, 1.0])
        return caused

    def typical(self) -> tuple[float, float]:
        """Return the largest departures of a typical axis [rad or m] and of its rate [rad/s or m/s].

        Errors of clocks are not counted, for they depend on how fast the axes are.
        """
        pushes, axes = self.sums[:, :, ACCELERATION], max(len(self.tracking.disturbance) - 1, 1)
        noises = self.noises(1)[0]
        steady = axis_errors(self.budget, self.tracking, axes).mean() + self.errors * TYPICAL_ACCELERATION
        pull = (noises[:, Q] + steady * pushes[:, Q]) / (1.0 - self.rest * pushes[:, Q])
        found = noises[:, :Q] + (steady + self.rest * pull)[:, None] * pushes[:, :Q]
        away, fast = found.max(axis=0).tolist()
        return away, fast


@lru_cache(maxsize=8)
def best_loop(budget: Budget, disturbance: tuple[float, ...] = (), weight: float = 0.0) -> AxisLoop | None:
    """Return the loop with the gains for which a typical axis departs least; None where none is stable.

    Args:
        budget: The budget.
        disturbance: As that of ``AxisTracking``.
        weight: What noise in a command counts beside a departure, see ``COMMAND_WEIGHTS`` [s^2].
    """
    best, least = None, inf
    for stiffness in STIFFNESSES:
        for damping in DAMPINGS:
            tracking = AxisTracking(stiffness, damping * stiffness**0.5, disturbance=disturbance)
            loop = axis_loop(tracking, budget)
            if loop is None:
                continue
            away, fast = loop.typical()
            found = away + RATE_WEIGHT * fast + weight * float(loop.noises(1)[:, :, Q].max())
            if found < least:
                best, least = loop, found
    return best


def axis_loop(tracking: AxisTracking, budget: Budget) -> AxisLoop | None:
    """Return the loop with some gains, None where it is not stable for every error of the model."""
    T = budget.period
    periods = whole_periods(budget.delay, T), whole_periods(HORIZON, T)
    gains, factors = (tracking.stiffness, tracking.damping), _factors(budget)
    kicks = np.zeros((len(factors), 3, whole_periods(MEMORY, T)))
    answers = np.zeros(kicks[:, 0].shape)
    runs = zip(factors, kicks, answers, strict=True)
    sums = np.array([_sums(gains, T, budget.lag, factor, periods, own, pull) for factor, own, pull in runs])
    good = np.isfinite(sums).all() and (_rest(budget) * sums[:, Q, ACCELERATION] < 1.0).all()
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
    period: float,
    lag: float,
    factor: float,
    periods: tuple[int, int],
    kicks: FloatArray,
    answers: FloatArray,
) -> FloatArray:
    """Return the sums of the magnitudes of responses, shape (3, 3), infinite where one does not end.

    An acceleration w within a period acts on the sample after it by (T - t) on e and by 1 on e';
    |h_e (T - t) + h_v| is convex in t, so that its chord is above it.

    Args:
        gains: K_a [1/s^2] and zeta_a [1/s].
        period: T [s].
        lag: Time constant of the actuators [s].
        factor: f [-].
        periods: Delay and ``HORIZON`` in periods.
        kicks: Receives the responses to a unit of acceleration within ``MEMORY``, the oldest first, shape (3,
            memory).
        answers: Receives the pull that answers a unit of command, likewise, shape (memory,).
    """
    T, (delay, n), memory = period, periods, kicks.shape[1]
    left, in_v, in_x = lag_factors(T, lag)
    e, v, pull = np.zeros((3, n + 1)), np.zeros((3, n + 1)), np.zeros((3, n + 1))
    e[1, 0], v[2, 0] = 1.0, 1.0  # the runs: a unit command, a unit of e and one of e'
    q, sums, quiet = np.zeros(3), np.zeros((3, 3)), 0
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
        for i, h in enumerate((e, v, pull)):
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
    return np.full((3, 3), np.inf)
