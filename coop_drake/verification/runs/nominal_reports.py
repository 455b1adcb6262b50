"""Delta E and the ready reports under a budget, computed again from nominal motions, which all robots share.

Delta E = K (d |d| - a^2) / 2, with the distance d of p_G to the boundary of the governed set and
a^2 = |p^ - p_G|^2 + |p^'|^2 / K. A robot is ready to leave a cell when d - a in the next one is at least
twice the way that p_G can still go until the switch, when the hand-over is over, and when the nominal motions
of its axes are at rest, as the plan says. What counts as arrived in the last cell is not checked here.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.cells import signed_distances
from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.runs.tube import SAME_TIME, nominal_axes, position_states, samples_of

SAME = 1e-8
"""Numbers that are computed twice may differ by so much [m, m^2/s^2]."""

REPORTED = 1e-6
"""Share by which reports may differ [-]: nominal motions of axes are computed by other formulas, and what
rounding leaves of this is divided by distances of some tenths of a millimetre."""

SWITCHING = 2
"""Periods in which p_G goes on after a report was received: the switch, and until robots hear of it [-]."""

ATTRACTION = 30.0
"""Rate at which p_G approaches its target at most [1/s]."""


def check_nominal_reports(rows: Rows, joint_robots: Sequence[int]) -> list[Check]:
    """Check Delta E and reports of a team under a budget; nothing for a plan without one.

    Args:
        rows: The log of a team whose robots compute at the same instants, with clocks that agree.
        joint_robots: Index of the robot of every joint, length n.

    Raises:
        RefusalError: Names the first entry for which a statement does not hold.
    """
    budget = rows.plan.budget
    if budget is None or rows.plan.tube is None:
        return []
    checks = [_check_margin(rows)]
    if budget.axes and not rows.log.held.any():  # in a hold the clock of the axes stands still
        checks.append(_check_reports(rows, joint_robots))
    return checks


def _check_margin(rows: Rows) -> Check:
    """Check Delta E of the nominal motion in every row, and that all robots have one p_G, at rest in between.

    A row between two samples has what was computed for the later one.
    """
    log, plan, (sample, late, first) = rows.log, rows.plan, samples_of(rows)
    p_G, stiffness = log.governor_position[first], plan.transitions[0].gains.stiffness
    at = np.searchsorted(sample[first], sample) + (late > SAME_TIME)
    known = at < len(first)
    at = np.minimum(at, len(first) - 1)
    squared = _squared_excursion(rows, p_G)[at]
    distance = np.empty(len(at))
    for k in range(len(plan.cells)):
        inside = log.cell_index == k
        distance[inside] = signed_distances(plan.governed(k), p_G[at[inside]])
    margins = 0.5 * stiffness * (distance * np.abs(distance) - squared)
    rows.require_same("energy_margin", np.where(known, margins, log.energy_margin), SAME)
    rows.require_same("governor_position", np.where(known[:, None], p_G[at], log.governor_position), SAME)
    rows.require_same("governor_spread", np.zeros(len(at)), SAME)
    arrays = "energy_margin", "governor_position", "governor_spread"
    name = "Delta E is that of the nominal position"
    return Check(name, len(at), float(margins.min()), "m²/s², least", arrays)


def _check_reports(rows: Rows, joint_robots: Sequence[int]) -> Check:
    """Check the reports of all samples but those in the last cell; one from a loud monitor is negative."""
    log, first, stated = rows.log, samples_of(rows)[2], rows.log.ready_margins
    axes = nominal_axes(rows, first)
    excursion = np.sqrt(_squared_excursion(rows, log.governor_position[first]))
    own = [
        [0, *(1 + i for i, robot in enumerate(joint_robots) if robot == k)]
        for k in range(len(log.robot_names))
    ]
    expected = stated.copy()
    for k in range(len(rows.plan.cells) - 1):
        inside = np.flatnonzero(log.cell_index[first] == k)
        margins = _leaving(rows, k, first[inside], excursion[inside], axes[inside])
        of_robots = np.column_stack([margins[:, 1:][:, columns].min(axis=1) for columns in own])
        expected[first[inside]] = np.minimum(margins[:, :1], of_robots)
    size = REPORTED * (1.0 + np.abs(expected))
    good = (np.abs(stated - expected) <= size) | ((stated < 0.0) & (stated <= expected))
    rows.require(good, "ready_margins", "is {:.9g}; the nominal motions give {:.9g}", stated, expected)
    return Check("reports are those of the nominal motions, but for the last cell", stated.size)


def _leaving(rows: Rows, cell: int, members: IntArray, excursion: FloatArray, axes: FloatArray) -> FloatArray:
    """Margins of the object, and of all axes, in some rows of a cell before the last, shape (m, 2 + n).

    Args:
        rows: The log.
        cell: The cell.
        members: The rows, of samples, shape (m,).
        excursion: a, shape (m,) [m].
        axes: Nominal axes and rates, shape (m, 2, 1 + n).
    """
    log, transition, budget, tube = rows.log, rows.plan.transitions[cell], rows.plan.budget, rows.plan.tube
    rest = transition.gains.rest
    if rest is None or budget is None or tube is None:
        raise RefusalError(f"plan: transitions[{cell}].gains.rest", "is missing, but the plan has a budget")
    p_G, period = log.governor_position[members], budget.period
    periods = ceil(budget.report_age / period - 1e-9) + SWITCHING
    room = signed_distances(rows.plan.governed(cell + 1), p_G) - excursion
    way = np.hypot(*(p_G - transition.target).T) * ((1.0 + ATTRACTION * period) ** periods - 1.0)
    needed = 2.0 * np.minimum(periods * period * tube.speed, way)
    entering = (room - needed) / np.maximum(np.maximum(np.abs(room), needed), 1e-9)
    after = max(transition.gains.hand_over_time, rest.after)
    if after > 0.0:
        over = (log.times[members] - log.transition_start[members]) / after - 1.0
        entering = np.minimum(entering, np.minimum(over, 1.0))
    away = np.abs(axes[:, 0] - 0.5 * (transition.goal_lower + transition.goal_upper))
    still = 1.0 - np.maximum(away / rest.reach, np.abs(axes[:, 1]) / rest.rate)
    return np.column_stack([entering, still])


def _squared_excursion(rows: Rows, p_G: FloatArray) -> FloatArray:
    """Return a^2 at every sample, shape (samples,) [m^2]."""
    off, rate = position_states(rows, p_G).transpose(1, 0, 2)
    stiffness = rows.plan.transitions[0].gains.stiffness
    squared: FloatArray = (off**2).sum(axis=1) + (rate**2).sum(axis=1) / stiffness
    return squared
