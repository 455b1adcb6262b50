"""Delta E and the ready reports of an ideal team, computed again from the states.

A robot is ready to leave a cell when each axis that it knows lies in its goal interval without a tenth at
both ends and has an energy small enough for the next funnel, when the object would provably stay in the next
cell: Delta E = K d |d| / 2 - (|p'|^2 + K |p - p_G|^2) / 2 is at least (K / 2) (R / 2)^2, and when the gains
have reached those of the cell, in which K goes from K_0 to K_1 within T as K_1 (K_0 / K_1)^f, f being the
factor of a quintic funnel that closes at T. Where the plan says so, a cell is left at rest instead: after a
stated time, with each axis within a stated distance of the middle of its goal interval and below a stated
rate. In the last cell it is ready when object and axes are at their
goals and at rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.cells import signed_distances
from coop_drake.verification.runs.funnels import CLOSED, entry_energies, quintic
from coop_drake.verification.runs.rows import Rows

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
            of_object[members], of_axes[members] = _arriving(rows, members, problem.position_tolerance)
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
    rest, duration = plan.transitions[cell].gains.rest, plan.transitions[cell].gains.hand_over_time
    if rest is None:
        following, axes = plan.transitions[cell + 1].gains, rows.z[members, 2:]
        energy = entry_energies(plan, cell + 1, axes, rows.rates[members, 2:])
        settled = (following.energy_bound - energy) / np.maximum(energy, following.energy_bound)
        of_axes = np.minimum(_inside_goal(rows, members, cell), settled)
    else:
        of_axes = 1.0 - rest_shares(plan, cell, rows.z[members, 2:], rows.rates[members, 2:])
        duration = max(duration, rest.after)
    at_entry = np.zeros(int(members.sum()))
    margin = _energy_margin(rows, members, cell + 1, at_entry)
    floor = 0.5 * _governed(plan, cell + 1, at_entry)[0] * (0.5 * plan.transitions[cell].inradius) ** 2
    of_object = (margin - floor) / np.maximum(np.abs(margin), floor)
    time = log.times - log.transition_start
    if duration > 0.0:
        of_object = np.minimum(of_object, np.minimum(time[members] / duration - 1.0, 1.0))
    change = 2.0 * STEP * np.abs(log.object_twist[members, :2]).sum(axis=1) / floor
    return of_object, of_axes, change


def rest_shares(plan: Plan, cell: int, axes: FloatArray, rates: FloatArray) -> FloatArray:
    """Departures from rest over those with which a cell may be left, per axis, the larger of both [-].

    Where nominal motions are at rest, what axes may depart from them comes on top.

    Args:
        plan: A plan whose cells are left at rest.
        cell: The cell that is left.
        axes: (theta, q...), shape (..., 1 + n) [rad or m].
        rates: Their rates, of the same shape.
    """
    transition = plan.transitions[cell]
    assert transition.gains.rest is not None  # the caller asks for no other plan
    away = np.abs(axes - 0.5 * (transition.goal_lower + transition.goal_upper))
    reach, rate, stated = transition.gains.rest.reach, transition.gains.rest.rate, transition.tolerance
    if stated is not None:
        reach, rate = reach + stated.departure, rate + stated.rate_departure
    shares: FloatArray = np.maximum(away / reach, np.abs(rates) / rate)
    return shares


def _arriving(rows: Rows, members: NDArray[np.bool_], tolerance: float) -> tuple[FloatArray, FloatArray]:
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
