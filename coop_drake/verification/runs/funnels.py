"""Check the funnels of a run by a formula of the checker's own, and how much energy the axes had in them.

The bounds of an axis are rho_G + (rho_0 - rho_G) f(t), t being the time since the cell was entered
less the clock's lag. The
energy of an axis, (41) and (48), is V = kappa s^2 / 2 + (x' - v)^2 / 2 with s = ln((x - rho_l) / (rho_u - x))
and v = (rho_l' (rho_u - x) + rho_u' (x - rho_l) - k1 s (x - rho_l)(rho_u - x)) / (rho_u - rho_l).
"""

from __future__ import annotations

from collections.abc import Callable
from math import e, sqrt

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.laws.gains import FunnelShape
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.between import Between
from coop_drake.verification.runs.holds import RATE
from coop_drake.verification.runs.rows import Rows

ROUNDING = 1e-8
"""Bounds and margins that are computed twice may differ by so much [rad or m]."""

CLOSED = 5.0
"""lambda t at which a quintic funnel is closed [-]."""


def quintic(x: FloatArray) -> FloatArray:
    """Factor of a quintic funnel as a function of lambda t."""
    u = np.minimum(x / CLOSED, 1.0)
    left: FloatArray = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    return left


SHAPES: dict[FunnelShape, tuple[Callable[[FloatArray], FloatArray], float, float]] = {
    "exponential": (lambda x: np.exp(-x), 1.0, 1.0),
    "quintic": (quintic, 1.875 / CLOSED, 10.0 / sqrt(3.0) / CLOSED**2),
}
"""For every shape f as a function of lambda t, then the largest |f'| and |f''| over lambda t."""


def bounds_at(plan: Plan, cell: int, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of all axes at some times since a cell was entered, shape (m, 1 + n) each."""
    entered, transition = plan.cells[cell], plan.transitions[cell]
    gains = transition.gains
    left = SHAPES[gains.funnel][0](times[:, None] * gains.decay_rate)
    lower = transition.goal_lower + (entered.lower - transition.goal_lower) * left
    upper = transition.goal_upper + (entered.upper - transition.goal_upper) * left
    return lower, upper


def check_funnels(rows: Rows, between: Between) -> tuple[Check, Check]:
    """Check the stated funnels, and that every axis lay inside its funnel, between rows, too."""
    log, plan, axes = rows.log, rows.plan, rows.z[:, 2:]
    lower, upper = np.empty_like(axes), np.empty_like(axes)
    least = np.inf
    for members, k in reversed(rows.motions):  # the row of an entry is stated for the cell that is left
        lag = np.concatenate(([0.0], log.clock_lag[members[1:]]))
        times = log.times[members] - log.times[members[0]] - lag
        lower[members], upper[members] = bounds_at(plan, k, times)
        margins = np.minimum(axes[members] - lower[members], upper[members] - axes[members])
        inner = np.minimum(margins[1:], margins[:-1]) - between.deviations[members[:-1], 2:]
        accelerations = _largest_acceleration(plan, k, held=bool(log.held.any()))
        inner -= 0.125 * (rows.steps[members[:-1]] ** 2)[:, None] * accelerations
        first, where = int(members[0]), f"outside the funnel of cell {k}"
        rows.require(margins > 0.0, "angle, joints", f"lies {where}", first=first)
        since = f"may have been {where} since the row before: the log is too sparse"
        rows.require(inner > 0.0, "angle, joints", since, first=first + 1)
        least = min(least, float(inner.min(initial=np.inf)))
    largest = max(
        rows.require_same("funnel_lower", lower, ROUNDING), rows.require_same("funnel_upper", upper, ROUNDING)
    )
    return (
        Check(
            "funnels are those of the plan",
            2 * axes.size,
            largest,
            "rad or m, largest difference",
            ("funnel_lower", "funnel_upper", "clock_lag"),
        ),
        Check("every axis lay in them, between rows, too", 2 * axes.size, least, "rad or m, least"),
    )


def check_stated_funnels(rows: Rows) -> Check:
    """Check that in every row every axis lay in the funnel that is stated there."""
    log, axes = rows.log, rows.z[:, 2:]
    margins = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    rows.require(margins > 0.0, "angle, joints", "lies outside the stated funnel")
    rows.require_same("funnel_margin", margins.min(axis=1), ROUNDING)
    name, least = "every axis lay in the stated funnels", float(margins.min())
    return Check(name, axes.size, least, "rad or m, least", ("funnel_margin",))


def entry_energies(plan: Plan, cell: int, axes: FloatArray, rates: FloatArray) -> FloatArray:
    """Energy V of every axis at the moment at which a cell is entered, shape (1 + n,).

    Args:
        plan: The plan.
        cell: The cell that is entered.
        axes: (theta, q...), shape (1 + n,) [rad or m].
        rates: Their rates, shape (1 + n,).
    """
    entered, transition = plan.cells[cell], plan.transitions[cell]
    gains = transition.gains
    rate = -gains.decay_rate if gains.funnel == "exponential" else 0.0 * gains.decay_rate
    width = entered.upper - entered.lower
    near = gains.saturation * width
    below, above = (np.clip(d, near, width - near) for d in (axes - entered.lower, entered.upper - axes))
    s = np.log(below / above)
    moving = (entered.lower - transition.goal_lower) * above + (entered.upper - transition.goal_upper) * below
    gain = gains.position_gain if gains.ramp_rate == 0.0 else 0.0  # k1 is ramped in from zero
    wanted = (rate * moving - gain * s * below * above) / width
    energies: FloatArray = 0.5 * gains.log_gain * s * s + 0.5 * (rates - wanted) ** 2
    return energies


def _largest_acceleration(plan: Plan, cell: int, *, held: bool) -> FloatArray:
    """Largest acceleration of a bound of every axis in one cell, shape (1 + n,) [rad/s^2 or m/s^2].

    Where the team may be held, the clock's pace changes by at most its rate over e, which adds to it.
    """
    entered, transition = plan.cells[cell], plan.transitions[cell]
    gains = transition.gains
    moved = np.maximum(transition.goal_lower - entered.lower, entered.upper - transition.goal_upper)
    rate, fastest, acceleration = gains.decay_rate, *SHAPES[gains.funnel][1:]
    largest = acceleration * rate**2 + (RATE / e * fastest * rate if held else 0.0)
    bounds: FloatArray = largest * np.maximum(moved, 0.0)
    return bounds
