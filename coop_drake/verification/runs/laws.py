"""Check what a run states about the plan's laws: cells, funnels, their clock, reports and hand-overs."""

from __future__ import annotations

from collections.abc import Callable
from math import e, sqrt

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws.ppc import FunnelShape
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Between, Rows

ROUNDING = 1e-8
"""Distances, bounds and margins that are computed twice may differ by so much [m, rad]."""


def check_cells(rows: Rows, between: Between) -> tuple[Check, Check]:
    """Check position and axes against the current cell in every row and between rows.

    A row at which a cell is entered must lie in both its cells. Between two rows the position is as near to
    the chord as ``Between`` says, and so is every axis.
    """
    log, plan = rows.log, rows.plan
    clearance, slices = np.empty(len(log.times)), np.empty(len(log.times))
    least, least_slice = np.inf, np.inf
    for members, k in reversed(rows.motions):  # the row of an entry is stated for the cell that is left
        cell, first = plan.cells[k], int(members[0])
        position, axes = rows.z[members, :2], rows.z[members, 2:]
        deviations = between.deviations[members[:-1]]
        inside = signed_distances(cell.tidied, position)
        chords = shapely.linestrings(np.stack((position[:-1], position[1:]), axis=1))
        left = shapely.distance(chords, cell.tidied.boundary) - np.hypot(deviations[:, 0], deviations[:, 1])
        margins = np.minimum(axes - cell.lower, cell.upper - axes)
        inner = np.minimum(margins[1:], margins[:-1]) - deviations[:, 2:]
        for name, at_rows, since, where in (
            ("object_pose", inside, left, f"cell {k}"),
            ("angle, joints", margins, inner, f"the intervals of cell {k}"),
        ):
            rows.require(at_rows > 0.0, name, f"lies outside {where}", first=first)
            text = f"may have left {where} since the row before: the log is too sparse"
            rows.require(since > 0.0, name, text, first=first + 1)
        clearance[members], slices[members] = inside, margins.min(axis=1)
        least = min(least, float(left.min(initial=np.inf)))
        least_slice = min(least_slice, float(inner.min(initial=np.inf)))
    rows.require_same("cell_clearance", clearance, ROUNDING)
    rows.require_same("slice_margin", slices, ROUNDING)
    place, interval = (
        "the position lay in its cell, between rows, too",
        "every axis lay in its cell's interval",
    )
    count = 2 * len(log.times)
    return (
        Check(place, count, least, "m, least", ("cell_clearance",)),
        Check(
            f"{interval}, between rows, too",
            count * (rows.z.shape[1] - 2),
            least_slice,
            "rad or m, least",
            ("slice_margin",),
        ),
    )


def signed_distances(region: Polygon, points: FloatArray) -> FloatArray:
    """Distances of points (m, 2) to a region's boundary, negative outside, shape (m,) [m]."""
    away = shapely.distance(shapely.points(points), region.boundary)
    signed: FloatArray = np.where(shapely.contains_xy(region, points[:, 0], points[:, 1]), away, -away)
    return signed


# Check the funnels of a run by a formula of the checker's own, and how much energy the axes had in them.
#
# The bounds of an axis are rho_G + (rho_0 - rho_G) f(t), t being the time since the cell was entered less
# the clock's lag. The energy of an axis, (41) and (48), is V = kappa s^2 / 2 + (x' - v)^2 / 2 with s =
# ln((x - rho_l) / (rho_u - x)) and v = (rho_l' (rho_u - x) + rho_u' (x - rho_l) - k1 s (x - rho_l)(rho_u -
# x)) / (rho_u - rho_l).


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
        rows.require_same("funnel_lower", lower, ROUNDING),
        rows.require_same("funnel_upper", upper, ROUNDING),
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
    """Check that in every row every axis lay in the interval that is stated there."""
    log, axes = rows.log, rows.z[:, 2:]
    margins = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    rows.require(margins > 0.0, "angle, joints", "lies outside the stated interval")
    rows.require_same("funnel_margin", margins.min(axis=1), ROUNDING)
    name, least = "every axis lay in the intervals that the log states", float(margins.min())
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


# Check the funnels' clock of a run: it lags behind only where the team is held, or was shortly before.

RATE = 10.0
"""Rate with which the clock slows down and runs again [1/s]."""

SETTLED = 2.0
"""Time after a change of ``held`` until the clock stands still or runs freely, within
``CLOCK_ROUNDING`` [s]."""

PAUSE = 1.0
"""So long after a hold no cell is left [s]."""

CLOCK_ROUNDING = 1e-6
"""Share of a step by which a clock that stands still may go on, or one that runs may lag [-]."""


def check_clock(rows: Rows, *, one_hold: bool, never_held: bool = False) -> Check:
    """Check that the stated lag grows with time while the team is held, and not where it is free for long.

    Where robots do not hear of a hold at once, the first one's lag is only no more than the time.
    """
    log, h = rows.log, rows.steps
    if never_held:
        for name in ("held", "clock_lag"):
            rows.require_same(name, np.zeros(len(log.times)), 0.0)
    rows.require((log.held == 0.0) | (log.held == 1.0), "held", "is {}; expected 0 or 1", log.held)
    rows.require_same("clock_lag", np.zeros(1), 0.0)
    entered = np.diff(log.cell_index) > 0
    grown = np.where(entered, log.clock_lag[1:], np.diff(log.clock_lag))
    rounding = CLOCK_ROUNDING * h + 1e-12
    text = "grew by {:.9g} s in a step of {:.9g} s"
    allowed = (grown >= -rounding) & (grown <= h + rounding)
    rows.require(allowed, "clock_lag", text, grown, h, first=1)
    long_free = ~_within(rows, log.held > 0.0, SETTLED)[1:] & one_hold
    rows.require(~long_free | (grown <= rounding), "clock_lag", text + " without a hold", grown, h, first=1)
    long_held = ~_within(rows, log.held < 1.0, SETTLED)[1:] & one_hold
    rows.require(~long_held | (grown >= h - rounding), "clock_lag", text + " of a hold", grown, h, first=1)
    count = int((np.diff(log.held, prepend=0.0) > 0.0).sum())
    lost = float(np.where(entered, log.clock_lag[:-1], 0.0).sum() + log.clock_lag[-1])
    arrays = ("held", "clock_lag") if never_held else ()
    return Check("the funnels' clock stands still where the team is held", count, lost, "s lost", arrays)


def paused(rows: Rows) -> NDArray[np.bool_]:
    """Whether the team is held, or was shortly before, in every row, shape (T,)."""
    return _within(rows, rows.log.held > 0.0, PAUSE)


def _within(rows: Rows, happened: NDArray[np.bool_], time: float) -> NDArray[np.bool_]:
    """Whether something happened in a row or less than some time before it, shape (T,)."""
    times = rows.log.times
    last = np.maximum.accumulate(np.where(happened, times, -np.inf))
    return np.asarray(times - last <= time + np.max(rows.steps, initial=0.0), dtype=np.bool_)


# Delta E and the ready reports of an ideal team, computed again from the states.
#
# A robot is ready to leave a cell when each axis that it knows lies in its goal interval without a tenth at
# both ends and has an energy small enough for the next funnel, when the object would provably stay in the
# next cell: Delta E = K d |d| / 2 - (|p'|^2 + K |p - p_G|^2) / 2 is at least (K / 2) (R / 2)^2, and when
# the gains have reached those of the cell, in which K goes from K_0 to K_1 within T as K_1 (K_0 / K_1)^f, f
# being the factor of a quintic funnel that closes at T. Where the plan says so, a cell is left at rest
# instead: after a stated time, with each axis within a stated distance of the middle of its goal interval
# and below a stated rate. In the last cell it is ready when object and axes are at their goals and at rest.

GOAL_SHARE = 0.8
"""Share of a goal interval, about its middle, in which an axis counts as arrived [-]."""

ARRIVED_SHARE = 0.9
"""Share of the position's tolerance within which the object counts as arrived [-]."""

REST_SPEED = 0.01
"""Largest speed of the object's origin that counts as rest [m/s]."""

REST_RATE = 0.02
"""Largest rate of an axis that counts as rest [rad/s or m/s]."""

STEP = 2.0**-26
"""Robots compute Delta E from a velocity that is rounded to a multiple of this [m/s]."""

DRIVEN = 1e-7
"""Accelerations that are computed twice may differ by so much [m/s^2]."""

TINY = 1e-300
"""Least divisor [m^2/s^2]."""

SAME = 1e-8
"""Numbers that are computed twice may differ by so much [m, m^2/s^2, -]."""


def check_energy_margin(rows: Rows) -> Check:
    """Check Delta E: it is what it should be, never negative, and all robots have one p_G."""
    log = rows.log
    margins, speeds = np.empty(len(log.times)), np.abs(log.object_twist[:, :2]).sum(axis=1)
    for k in range(len(rows.plan.cells)):
        members = log.cell_index == k
        margins[members] = _energy_margin(
            rows, members, k, log.times[members] - log.transition_start[members]
        )
    rows.require_same("energy_margin", margins, SAME + STEP * speeds)
    rows.require(log.energy_margin >= 0.0, "energy_margin", "is {:.3g}, negative", log.energy_margin)
    rows.require_same("governor_spread", np.zeros(len(log.times)), SAME)
    name, least = "Delta E is right and never negative", float(margins.min())
    return Check(name, len(log.times), least, "m²/s², least", ("energy_margin", "governor_spread"))


def check_reference(rows: Rows) -> Check:
    """Check that the object is accelerated as p_G says, by (14); mechanics ties this to forces.

    Near the limit L of the object's speed v there is more damping, the least for which
    a . v <= zeta (L^2 - |v|^2) / 2.
    """
    log, expected = rows.log, np.empty((len(rows.log.times), 2))
    for k, transition in enumerate(rows.plan.transitions):
        members = log.cell_index == k
        times = log.times[members] - log.transition_start[members]
        stiffness, damping = _governed(rows.plan, k, times)
        off, v = (
            (log.object_pose[members, :2] - log.governor_position[members]),
            log.object_twist[members, :2],
        )
        a = -stiffness[:, None] * off - damping[:, None] * v
        limit, squared = transition.gains.speed_limit, (v**2).sum(axis=1)
        if limit is not None:
            excess = (a * v).sum(axis=1) - 0.5 * damping * (limit * limit - squared)
            more = np.where((excess > 0.0) & (squared > 0.0), excess / np.maximum(squared, TINY), 0.0)
            a = a - more[:, None] * v
        expected[members] = a
    difference = np.abs(log.accelerations[:, :2] - expected)
    text = "asks for {:.9g} m/s^2; the object was accelerated by {:.9g}"
    rows.require(difference <= DRIVEN, "governor_position", text, expected, log.accelerations[:, :2])
    name, largest = "the object was accelerated as p_G asks for", float(difference.max())
    return Check(name, difference.size, largest, "m/s², largest difference", ("governor_position",))


def check_reports(rows: Rows, problem: PlanningProblem) -> Check:
    """Check the margins that all robots report."""
    log, plan = rows.log, rows.plan
    of_object, of_axes = np.empty(len(log.times)), np.empty(rows.z[:, 2:].shape)
    tolerances = np.full(len(log.times), SAME)
    for k in range(len(plan.cells)):
        members = log.cell_index == k
        if k + 1 < len(plan.cells):
            of_object[members], of_axes[members], change = _leaving(rows, members, k)
            tolerances[members] += change
        else:
            of_object[members], of_axes[members] = arriving(rows, members, problem.position_tolerance)
    joints = problem.tree.joints
    own = [[0, *[1 + j.index for j in joints if j.robot == k]] for k in range(len(log.robot_names))]
    of_robots = np.column_stack([of_axes[:, axes].min(axis=1) for axes in own])
    margins = np.minimum(of_object[:, None], of_robots)
    largest = rows.require_same("ready_margins", margins, tolerances[:, None])
    name = "reports are those of the states"
    return Check(name, margins.size, largest, "largest difference", ("ready_margins",))


def _leaving(rows: Rows, members: NDArray[np.bool_], cell: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Margins of object (m,) and axes (m, 1 + n) in a cell before the last, and what rounding changes."""
    log, plan = rows.log, rows.plan
    duration = plan.transitions[cell].gains.hand_over_time
    following, axes = plan.transitions[cell + 1].gains, rows.z[members, 2:]
    energy = entry_energies(plan, cell + 1, axes, rows.rates[members, 2:])
    settled = (following.energy_bound - energy) / np.maximum(energy, following.energy_bound)
    of_axes = np.minimum(_inside_goal(rows, members, cell), settled)
    at_entry = np.zeros(int(members.sum()))
    margin = _energy_margin(rows, members, cell + 1, at_entry)
    floor = 0.5 * _governed(plan, cell + 1, at_entry)[0] * (0.5 * plan.transitions[cell].inradius) ** 2
    of_object = (margin - floor) / np.maximum(np.abs(margin), floor)
    time = log.times - log.transition_start
    if duration > 0.0:
        of_object = np.minimum(of_object, np.minimum(time[members] / duration - 1.0, 1.0))
    change = 2.0 * STEP * np.abs(log.object_twist[members, :2]).sum(axis=1) / floor
    return of_object, of_axes, change


def arriving(rows: Rows, members: NDArray[np.bool_], tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Margins of object (m,) and axes (m, 1 + n) in the last cell."""
    distance = np.hypot(*(rows.z[members, :2] - rows.plan.goal_pose[:2]).T)
    speed = np.hypot(*rows.rates[members, :2].T)
    there, still = 1.0 - distance / (ARRIVED_SHARE * tolerance), 1.0 - speed / REST_SPEED
    settled = 1.0 - np.abs(rows.rates[members, 2:]) / REST_RATE
    inside = _inside_goal(rows, members, len(rows.plan.cells) - 1)
    return np.minimum(there, still), np.minimum(inside, settled)


def _inside_goal(rows: Rows, members: NDArray[np.bool_], cell: int) -> FloatArray:
    transition = rows.plan.transitions[cell]
    middle = 0.5 * (transition.goal_lower + transition.goal_upper)
    half = 0.5 * GOAL_SHARE * (transition.goal_upper - transition.goal_lower)
    inside: FloatArray = 1.0 - np.abs(rows.z[members, 2:] - middle) / half
    return inside


def _governed(plan: Plan, cell: int, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """K [1/s^2] and zeta [1/s] at some times since a cell was entered, shape (m,) each."""
    gains, before = (plan.transitions[k].gains for k in (cell, max(cell - 1, 0)))
    left = quintic(CLOSED * times / gains.hand_over_time) if gains.hand_over_time > 0.0 else 0.0 * times
    stiffness: FloatArray = gains.stiffness * (before.stiffness / gains.stiffness) ** left
    return stiffness, gains.damping * (before.damping / gains.damping) ** left


def _energy_margin(rows: Rows, members: NDArray[np.bool_], cell: int, times: FloatArray) -> FloatArray:
    """Delta E of some rows in a cell [m^2/s^2], at some times since its entry, (m,).

    Velocities are rounded as the robots round them.
    """
    log, stiffness = rows.log, _governed(rows.plan, cell, times)[0]
    reference = log.governor_position[members]
    clearance = signed_distances(rows.plan.cells[cell].tidied, reference)
    velocity = np.rint(log.object_twist[members, :2] / STEP) * STEP
    lag = log.object_pose[members, :2] - reference
    energy = 0.5 * (velocity**2).sum(axis=1) + 0.5 * stiffness * (lag**2).sum(axis=1)
    margin: FloatArray = 0.5 * stiffness * clearance * np.abs(clearance) - energy
    return margin


def check_handovers(rows: Rows, *, exact: bool) -> list[Check]:
    """Check order and times of the cells, and the reports with which each was left.

    An ideal team leaves a cell in the first row in which all robots are ready, unless it is held. Otherwise
    reports travel, and every robot must have reported to be ready at some time in the cell.

    Args:
        rows: The log.
        exact: Whether the team is ideal.
    """
    log, plan, last = rows.log, rows.plan, len(rows.log.times) - 1
    if log.cell_index[-1] != len(plan.cells) - 1:
        raise RefusalError(
            f"cell_index[{last}]", f"is {log.cell_index[-1]}; expected the last cell at the end"
        )
    entered = np.concatenate(([0.0], log.times[rows.entries]))
    rows.require_same("transition_start", entered[log.cell_index], 0.0)
    ready = log.ready_margins >= 0.0
    if exact:
        leaves = np.diff(log.cell_index, append=len(plan.cells)) > 0
        rows.require(ready.all(axis=1) | ~leaves, "cell_index", "is left although a robot is not ready")
        kept = leaves | paused(rows) | ~ready.all(axis=1)
        rows.require(kept, "cell_index", "is kept although all robots are ready")
    for k in range(len(plan.cells)):
        members = np.flatnonzero(log.cell_index == k)
        for robot in np.flatnonzero(~ready[members].any(axis=0)):
            where = f"ready_margins[{members[-1]}, {robot}]"
            text = f"and all before in cell {k} are negative, but the cell is left"
            raise RefusalError(where, f"at t = {log.times[members[-1]]:.6g} s: {text}")
    name = "cells were entered one by one, each when all robots were ready"
    shares = [float(_share(rows, k, i).max()) for k, i in enumerate(rows.entries, 1)]
    used = "share of the energy that the axes may have when a cell is entered"
    return [
        Check(name, len(rows.entries), arrays=("cell_index", "transition_start")),
        Check(used, len(shares), max(shares, default=None), "of the bound, largest"),
    ]


def _share(rows: Rows, cell: int, row: int) -> FloatArray:
    """Energy of every axis over its bound when a cell is entered, shape (1 + n,)."""
    energies = entry_energies(rows.plan, cell, rows.z[row, 2:], rows.rates[row, 2:])
    share: FloatArray = energies / rows.plan.transitions[cell].gains.energy_bound
    return share
