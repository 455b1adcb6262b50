"""Check by the log of a run that nothing departed from its nominal motion by more than its plan states.

The nominal motions are not in the log. That of the position follows from p_G alone, which is at rest between
samples: from the start at rest it is carried from sample to sample as an oscillator about p_G. Those of the
axes follow from the plan and from the times at which cells were entered: they are commanded by the law of the
axes, which acts on themselves. In a run with holds they have a clock that stands still, and are not computed.
"""

from __future__ import annotations

from cmath import cosh, sinh, sqrt
from collections.abc import Sequence
from math import ceil, exp, inf, nan
from typing import NamedTuple

import numpy as np
import shapely

from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.laws import signed_distances
from coop_drake.verification.runs.rows import Rows

SAME_TIME = 1e-9
"""Times that differ by less are those of one instant [s]."""

ROUNDING = 1e-9
"""By how much a distance or rate that is computed again may differ from the logged one [m, rad, 1/s]."""


class Departure(NamedTuple):
    """One kind of departure in a run, and what the plan states about it.

    Attributes:
        statement: What is stated, in words.
        array: The log's array that it is about.
        what: What departs, a name for each column.
        finding: What is wrong where more is found than stated, with a place for both numbers.
        found: In some rows, shape (R, columns) [m, rad, and per second].
        stated: The largest one that is allowed there, of the same shape.
        rows: Which rows these are, shape (R,).
    """

    statement: str
    array: str
    what: tuple[str, ...]
    finding: str
    found: FloatArray
    stated: FloatArray
    rows: IntArray

    @property
    def shares(self) -> FloatArray:
        """The found ones over the stated ones [-]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            shares: FloatArray = np.where(self.found > 0.0, self.found / self.stated, 0.0)
        return shares


class Largest(NamedTuple):
    """Where a run departed the most of all, as a share of what the plan states.

    Attributes:
        share: The share [-].
        what: What departed.
        time: When [s].
    """

    share: float
    what: str
    time: float


def check_budget_used(rows: Rows) -> list[Check]:
    """Check what a plan's budget states against the run; nothing for a plan without a budget."""
    plan = rows.plan
    if plan.budget is None or plan.tube is None:
        return []
    _check_nominal(rows, plan.tube.speed)
    checks = []
    for one in stated_departures(rows):
        held, values = np.ones((len(rows.log.times), one.found.shape[1]), dtype=np.bool_), []
        for array in (one.found, one.stated):
            values.append(np.zeros(held.shape))
            values[-1][one.rows] = array
        held[one.rows] = one.found <= one.stated + ROUNDING
        rows.require(held, one.array, one.finding, *values)
        checks.append(Check(one.statement, one.found.size, float(one.shares.max()), "of it used"))
    return checks


def largest_departure(rows: Rows, until: float = inf) -> Largest | None:
    """Return the largest departure of a run until some time [s]; None for a plan without a budget.

    Raises:
        RefusalError: The log does not have all samples that the nominal motion depends on.
    """
    found = []
    for one in stated_departures(rows):
        shares = one.shares[rows.log.times[one.rows] < until]
        if not shares.size:
            continue
        row, column = np.unravel_index(int(np.argmax(shares)), shares.shape)
        share, time = float(shares[row, column]), float(rows.log.times[one.rows[row]])
        found.append(Largest(share, one.what[int(column)], time))
    return max(found, default=None)


def budget_share(rows: Rows) -> float:
    """Return the largest share that a run used of what its plan's budget states [-]; NaN without a budget.

    Raises:
        RefusalError: The log does not have all samples that the nominal motion depends on.
    """
    largest = largest_departure(rows)
    return nan if largest is None else largest.share


def stated_departures(rows: Rows) -> list[Departure]:
    """Return all departures about which a plan with a budget states something.

    An axis that comes nearer to a bound of its funnel than stated departs by the stated distance where it
    should keep it: the share is the stated distance over the kept one.

    Raises:
        RefusalError: The log does not have all samples that the nominal motion depends on.
    """
    plan, log = rows.plan, rows.log
    if plan.budget is None or plan.tube is None:
        return []
    every, names = np.arange(len(log.times)), ("the object's angle", *log.joint_names)
    sample, late, first = samples_of(rows)
    nominal = _nominal(rows, log.governor_position[first], first, sample, late)
    z, rates = log.object_pose[:, :2], log.object_twist[:, :2]
    off = [np.hypot(*(seen - led).T)[:, None] for seen, led in zip((z, rates), nominal, strict=True)]
    found = [
        Departure(statement, array, (what,), finding, values, np.full(values.shape, stated), every)
        for statement, array, what, finding, values, stated in (
            (
                "the object stayed in the tube of its budget",
                "object_pose",
                "the object's position",
                _FAR.format("m"),
                off[0],
                plan.tube.radius,
            ),
            (
                "its velocity stayed as near to the nominal one",
                "object_twist",
                "the object's velocity",
                _FAR.format("m/s"),
                off[1],
                plan.tube.rate,
            ),
        )
    ]
    if not plan.budget.axes:
        return found
    kept = np.minimum(rows.z[:, 2:] - log.funnel_lower, log.funnel_upper - rows.z[:, 2:])
    least = _of_cells(plan, log.cell_index, "distance")
    near = np.where(kept > 0.0, kept, 0.0)
    nearness = (
        "comes nearer to a bound of its funnel than stated: the stated distance is {:.6g} times its own"
    )
    with np.errstate(divide="ignore"):
        statement, shares = "axes kept the distances that the budget states", least / near
        found.append(
            Departure(statement, "angle, joints", names, nearness, shares, np.ones(least.shape), every)
        )
    if not log.held.any():
        axes = nominal_axes(rows, first)
        of_rates = tuple(f"the rate of {name}" for name in names)
        for statement, name, array, seen, led, what in (
            (
                "axes stayed in the tubes of their budget",
                "departure",
                "angle, joints",
                rows.z,
                axes[:, 0],
                names,
            ),
            (
                "their rates stayed as near to the nominal ones",
                "rate_departure",
                "joint_rates",
                rows.rates,
                axes[:, 1],
                of_rates,
            ),
        ):
            stated = _of_cells(plan, log.cell_index[first], name)
            away = np.abs(seen[first, 2:] - led)
            found.append(Departure(statement, array, what, _FAR.format("rad or m"), away, stated, first))
    return found


_FAR = "is {{:.6g}} {} from its nominal motion; the plan's budget states {{:.6g}}"


def _of_cells(plan: Plan, cells: IntArray, name: str) -> FloatArray:
    """Return a field of the tolerance of every cell given, shape (R, 1 + n)."""
    fields = [getattr(transition.tolerance, name) for transition in plan.transitions]
    return np.asarray(fields)[cells]


def samples_of(rows: Rows) -> tuple[IntArray, FloatArray, IntArray]:
    """Return of every row the sample before it and the time since then [s], and the samples' first rows."""
    times, period = rows.log.times, rows.plan.budget.period if rows.plan.budget else nan
    sample = np.floor(times / period + SAME_TIME / period).astype(np.int64)
    late = times - sample * period
    first = np.flatnonzero(np.abs(late) <= SAME_TIME)
    known = np.isin(sample, sample[first]) & (np.diff(sample, prepend=0) <= 1)
    rows.require(known, "times", "is not in a period whose first instant is in the log, too")
    return sample, late, first


def _check_nominal(rows: Rows, speed: float) -> None:
    """Check p_G at every sample, and that it led the nominal motion through its regions."""
    log, plan = rows.log, rows.plan
    assert plan.budget is not None  # checked by the caller
    sample, late, first = samples_of(rows)
    p_G = log.governor_position[first]
    steps = np.hypot(*np.diff(p_G, axis=0, prepend=p_G[:1]).T)
    text = "moved by {:.6g} m in a period, beyond the plan's largest speed"
    within = np.ones(len(log.times), dtype=np.bool_)
    within[first] = steps <= plan.budget.period * speed + ROUNDING
    moved = np.zeros(len(log.times))
    moved[first] = steps
    rows.require(within, "governor_position", text, moved)
    nominal = _nominal(rows, p_G, first, sample, late)[0]
    for k in range(len(plan.cells)):
        inside = (log.cell_index != k) | shapely.contains_xy(plan.governed(k), nominal[:, 0], nominal[:, 1])
        rows.require(inside, "governor_position", f"has led the nominal motion out of the region of cell {k}")


def _nominal(rows: Rows, p_G: FloatArray, first: IntArray, sample: IntArray, late: FloatArray) -> FloatArray:
    """Return the nominal position and velocity in every row, shape (2, T, 2) [m, m/s]."""
    gains, states = rows.plan.transitions[0].gains, position_states(rows, p_G)
    nominal = np.empty((2, len(sample), 2))
    at = np.searchsorted(sample[first], sample)
    for row, (i, time) in enumerate(zip(at, late, strict=True)):
        carried = (
            states[i] if time <= SAME_TIME else oscillator(gains.stiffness, gains.damping, time) @ states[i]
        )
        nominal[:, row] = p_G[i] + carried[0], carried[1]
    return nominal


def position_states(rows: Rows, p_G: FloatArray) -> FloatArray:
    """Return p^ - p_G and p^' at every sample, shape (samples, 2, 2), the coordinates last [m, m/s]."""
    plan, gains = rows.plan, rows.plan.transitions[0].gains
    assert plan.budget is not None  # checked by the caller
    flow = oscillator(gains.stiffness, gains.damping, plan.budget.period)
    states, state = np.empty((len(p_G), 2, 2)), np.array([plan.start[:2] - p_G[0], np.zeros(2)])
    for i in range(len(p_G)):
        states[i] = state
        state = flow @ state
        state[0] -= p_G[min(i + 1, len(p_G) - 1)] - p_G[i]
    return states


def nominal_axes(rows: Rows, first: IntArray) -> FloatArray:
    """Return nominal axes and their rates at all samples, shape (samples, 2, 1 + n) [rad or m, and per s].

    Args:
        rows: A run without holds.
        first: The samples' first rows.
    """
    plan, log, count = rows.plan, rows.log, rows.z.shape[1] - 2
    assert plan.budget is not None  # checked by the caller
    nothing = np.zeros(count)
    rests = [plan.start[2:], *(0.5 * (one.goal_lower + one.goal_upper) for one in plan.transitions[:-1])]
    jumps = [-commanded(plan, k, 0.0, rest, nothing) for k, rest in enumerate(rests)]
    T, lag = plan.budget.period, plan.budget.lag
    left = exp(-T / lag) if lag > 0.0 else 0.0
    in_v = lag * (1.0 - left)
    in_x = lag * (T - in_v)
    matrix = np.array([[1.0, T, in_x], [0.0, 1.0, in_v], [0.0, 0.0, left]])  # of (x, v, acceleration)
    enters = np.array([0.5 * T * T - in_x, T - in_v, 1.0 - left])
    state, states = np.array([plan.start[2:], nothing, nothing]), np.empty((len(first), 2, count))
    for i, row in enumerate(first):
        states[i] = state[:2]
        cell, time = int(log.cell_index[row]), float(log.times[row] - log.transition_start[row])
        fading = np.maximum(plan.transitions[cell].gains.hand_over_time, 1e-12)
        command = commanded(plan, cell, time, state[0], state[1]) + _left(time / fading)[0] * jumps[cell]
        state = matrix @ state + enters[:, None] * command
    return states


def commanded(plan: Plan, cell: int, time: float, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the accelerations that the law asks of all axes, written again in distances to the bounds.

    With the distances dl and du to the funnel's bounds, w = dl + du, s = ln(dl / du), P = s (dl - du) / w,
    and b, c the rates and accelerations with which the funnel carries a point along, the law is

        (k2 + k1 (1 - P) - w'/w) (b - v) + c - s dl du (k1 k2 + k1 w'/w + k1') / w - kappa w s / (dl du).

    Args:
        plan: A plan with quintic funnels.
        cell: The cell.
        time: Time since it was entered [s].
        x: Axes (theta, q...), shape (1 + n,) [rad or m].
        v: Their rates, shape (1 + n,) [rad/s or m/s].
    """
    transition, entered = plan.transitions[cell], plan.cells[cell]
    gains, goal = transition.gains, np.array([transition.goal_lower, transition.goal_upper])
    shrink, rate = np.array([entered.lower, entered.upper]) - goal, gains.decay_rate / 5.0
    share, first, second = _left(time * rate)
    (low, high), (low_rate, high_rate) = goal + shrink * share, shrink * rate * first
    low_bend, high_bend = shrink * rate**2 * second
    mu, k1, k1_rate, k2 = gains.ramp_rate, gains.position_gain, 0.0, gains.rate_gain
    if mu > 0.0:
        gone = exp(-mu * time)
        k1, k1_rate = k1 * (1.0 - gone - mu * time * gone), k1 * mu**2 * time * gone
    w, closing = high - low, (high_rate - low_rate) / (high - low)
    dl = np.clip(x - low, gains.saturation * w, (1.0 - gains.saturation) * w)
    du = w - dl
    s = np.log(dl / du)
    carried = (low_rate * du + high_rate * dl) / w - v
    bent = (low_bend * du + high_bend * dl) / w
    damping = k2 + k1 * (1.0 - s * (dl - du) / w) - closing
    spring = s * dl * du / w * (k1 * k2 + k1 * closing + k1_rate)
    law: FloatArray = damping * carried + bent - spring - gains.log_gain * w * s / (dl * du)
    return law


def _left(u: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return 1 - u^3 (10 - 15 u + 6 u^2), which is 0 from u = 1 on, and its derivatives by u."""
    u = np.minimum(u, 1.0)
    first, second = -30.0 * (u * (1.0 - u)) ** 2, -60.0 * u * (1.0 - 3.0 * u + 2.0 * u**2)
    return 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2), first, second


def oscillator(stiffness: float, damping: float, time: float) -> FloatArray:
    """Return the matrix that carries position and velocity of a damped oscillator, shape (2, 2).

    Args:
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        time: T [s].
    """
    half = 0.5 * damping
    root = sqrt(half * half - stiffness)
    even, odd = cosh(root * time), sinh(root * time) / root if abs(root * time) > 1e-6 else time
    rows = [[even + half * odd, odd], [-stiffness * odd, even - half * odd]]
    matrix: FloatArray = (exp(-half * time) * np.array(rows)).real
    return matrix


# Delta E and the ready reports under a budget, computed again from nominal motions, which all robots share.
#
# Delta E = K (d |d| - a^2) / 2, with the distance d of p_G to the boundary of the governed set and a^2 =
# |p^ - p_G|^2 + |p^'|^2 / K. A robot is ready to leave a cell when d - a in the next one is at least twice
# the way that p_G can still go until the switch, when the hand-over is over, and when the nominal motions
# of its axes are at rest, as the plan says. What counts as arrived in the last cell is not checked here.

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
