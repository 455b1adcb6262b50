"""How far axes depart where a team begins a cell anew from rest, see ``answers/budget.py``.

On the slow way of ``laws/actuators.py`` every axis has at most a rate and an acceleration that are the same
in all cells. The departures follow as in a transition, see ``departing.py``, from a rest with constant
errors. An axis that is taken for resting may have a small rate still: what this causes is added, by
superposition. The position's tube counts errors at all times before the rest, when none entered; what is
left of these must be more than what such a rate causes, see ``position_may_rest``.

A rest off by the error of a measurement is one with constant errors: before it and at all samples that are
still to be used, what was measured is where the nominal motion is. Rates were in the measurements, too, that
are used in the first m periods, with any sign.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.answers.budget import Budget, Restart
from coop_drake.answers.plan import Plan
from coop_drake.laws.actuators import ACCELERATION, RATE
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.nominal import lag_factors
from coop_drake.laws.readiness import RATE_TOLERANCE
from coop_drake.laws.sampling import whole_periods
from coop_drake.planning.budget.fitting import OTHERWISE, LimitedEfforts
from coop_drake.robustness.axis_departure import HORIZON, SLACK, AxisLoop, moving_evenly, single_noise
from coop_drake.robustness.axis_departure import PUSH as PUSHED
from coop_drake.robustness.position import HORIZON as POSITION_HORIZON
from coop_drake.robustness.position import E, V, position_errors, position_loop
from coop_drake.tree.pose import FloatArray

ROUNDED = 1e-7
"""What may be left of responses after the horizon [m, m/s, m/s^2]."""

SLOWER = (1.0, 0.5, 0.25, 0.1)
"""Shares of the usual rate and acceleration that are tried, where limits allow no more [-]."""


def with_restart(plan: Plan, loop: AxisLoop, couplings: FloatArray, limited: LimitedEfforts | None) -> Plan:
    """Return a plan that states from which rests its cells can be begun anew.

    Args:
        plan: The plan with its budget and the gains of its axes.
        loop: The loop that pulls the axes to their nominal motions.
        couplings: How much rates accelerate the axes in every cell.
        limited: What limits efforts, None where nothing does.

    Returns:
        The plan; without such a statement where limits allow no motion of the usual kind.
    """
    every = [transition.gains for transition in plan.transitions]
    counted = loop.tracking.rate or None, loop.tracking.acceleration or None  # with which wrong ages count
    resting = _resting(loop)
    for share in SLOWER:
        rate, acceleration = share * RATE, share * ACCELERATION
        found = [moving_evenly(loop, coupling, (acceleration, rate)) for coupling in couplings]
        within = [
            (fastest is None or (rate + one.rate + resting[1] < fastest).all())
            and (most is None or (acceleration + one.acceleration + resting[2] < most).all())
            for one, limits in zip(found, every, strict=True)
            for fastest, most in ((limits.rate_limit, limits.acceleration_limit), counted)
        ]
        pulls = np.array([one.pull + resting[2] + single_noise(loop, len(one.pull)) for one in found])
        within += [] if limited is None else _efforts_kept(limited, loop.budget, (rate, acceleration), pulls)
        if all(within):
            departures = tuple((1.0 + OTHERWISE) * (one.position + resting[0]) for one in found)
            return replace(plan, restart=Restart(rate, acceleration, RATE_TOLERANCE, HORIZON, departures))
    return plan


def reached_at_restart(loop: AxisLoop, couplings: FloatArray) -> FloatArray:
    """Return the largest rates and accelerations of axes on the usual slow way, shape (2, axes)."""
    _, fast, push = _resting(loop)
    every = [moving_evenly(loop, coupling, (ACCELERATION, RATE)) for coupling in couplings]
    reached = np.array([[RATE + one.rate + fast, ACCELERATION + one.acceleration + push] for one in every])
    most: FloatArray = (1.0 + OTHERWISE) * reached.max(axis=0)
    return most


def _efforts_kept(
    limited: LimitedEfforts, budget: Budget, moving: tuple[float, float], pulls: FloatArray
) -> list[bool]:
    """Return in which cells efforts are within their limits on the way, see ``transitions.py``.

    Args:
        limited: What limits them.
        budget: The budget.
        moving: Largest nominal rate and acceleration of every axis.
        pulls: Largest pull towards the nominal motion in every cell, shape (cells, axes).
    """
    of, kept = limited.efforts, []
    rates = np.full(pulls.shape[1], moving[0] + max(budget.ahead - budget.period, 0.0) * moving[1])
    for k, pull in enumerate(pulls):
        turning = of.axes[k] @ (moving[1] + pull) + np.einsum("j,ejk,k->e", rates, of.rates[k], rates)
        moved = limited.acceleration * of.push[k] + of.damping @ rates
        efforts = (1.0 + SLACK) * ((1.0 + budget.model_error) * turning + moved)
        kept.append(bool((efforts <= of.limits).all()))
    return kept


def position_may_rest(plan: Plan, budget: Budget) -> bool:
    """Whether the plan's position tube holds for an object that is taken for resting, too.

    With g the response to a unit of e' at the beginning, and h and h_w those to a unit of command and of
    acceleration in one period, this is so if at every sample k, for e, e' and the feedback,

        rest_rate (|g(k)| + zeta_t sum over i < m of |h(k - i)|)
            <= sum over j > k of (zeta_t n_v |h(j)| + w |h_w(j)|),

    for a rest that is off by n_p takes its part K_t n_p of what the tube counts.

    Args:
        plan: The plan with its tube.
        budget: The budget.
    """
    tube, gains = plan.tube, plan.transitions[0].gains
    if tube is None or plan.restart is None:
        return False
    T, delay = budget.period, whole_periods(budget.delay, budget.period)
    tracking = tube.tracking_stiffness, tube.tracking_damping
    for error in position_errors(budget):
        loop = position_loop((gains.stiffness, gains.damping, *tracking), T, delay, budget.lag, error)
        command, rate, place = _responses(*loop[:3], whole_periods(POSITION_HORIZON, T))
        pushed = 0.5 * T * (np.abs(place * T + rate) + np.abs(rate))
        entered = tracking[1] * budget.velocity_noise * np.abs(command)
        left = (entered + budget.acceleration_error * pushed)[::-1].cumsum(axis=0)[::-1]
        seen = np.abs(rate)
        for i in range(delay):
            seen[i:] += tracking[1] * np.abs(command[: len(command) - i])
        caused = plan.restart.rest_rate * seen
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


def _resting(loop: AxisLoop) -> FloatArray:
    """Return |e|, |e'| and |e''| that a rate at the beginning causes of an axis taken for resting, (3,)."""
    budget, (stiffness, damping) = loop.budget, (loop.tracking.stiffness, loop.tracking.damping)
    T, delay = budget.period, whole_periods(budget.delay, budget.period)
    left, in_v, in_x = lag_factors(T, budget.lag)
    found = np.zeros(3)
    for part, factor in enumerate(loop.factors):
        most = np.zeros(3)
        # The rate at the beginning, then one in each of the measurements that are used first.
        for first in range(1 + delay):
            e, v, q = [0.0] * (delay + 1), [0.0] * (delay + 1), 0.0
            v[-1 - first] = RATE_TOLERANCE
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
        sums = loop.sums[part, :, PUSHED]
        pull = most[2] / (1.0 - loop.rest * sums[2])
        away, fast = most[:2] + loop.rest * pull * sums[:2]
        push = (1.0 + budget.model_error) * pull
        found = np.maximum(found, [away + 0.125 * T * T * push, fast + T * push, push])
    return found
