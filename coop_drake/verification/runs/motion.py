"""Check what a run states about the motion of its plan, where the team passes from cell to cell."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from coop_drake.answers.motion import Motion
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws.words import CLOCK_ERROR, WORD_PERIOD
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.laws import DRIVEN, ROUNDING, SAME, STEP, arriving, signed_distances
from coop_drake.verification.runs.rows import Rows

PHASE, PACE, RATE = range(3)
"""Columns of a robot's phase."""


def check_followed(rows: Rows, problem: PlanningProblem, *, exact: bool) -> list[Check]:
    """Check that the team followed the motion of its plan.

    Args:
        rows: The log of a run whose plan has a motion.
        problem: The question.
        exact: Whether the team is ideal, so that the law's equations hold to rounding.

    Raises:
        RefusalError: Names the first entry for which a statement does not hold.
    """
    motion, log = rows.plan.motion, rows.log
    assert motion is not None  # the caller asks for no other run
    checks = [check_phases(rows, motion, exact=exact), _check_cells(rows, motion, exact=exact)]
    nominal, velocity, acceleration = motion_at_phases(motion, log.phases[:, 0])
    positions = np.stack(
        [motion_at_phases(motion, log.phases[:, k])[0][:, :2] for k in range(log.phases.shape[1])]
    )
    largest = rows.require_same("governor_position", positions[0], SAME)
    rows.require_same("governor_spread", np.abs(positions - positions[0]).max(axis=(0, 2)), SAME)
    arrays = ("governor_position", "governor_spread")
    checks.append(Check("the reference is the plan's motion", log.times.size, largest, "m, largest", arrays))
    away = float(np.hypot(*(rows.z[:, :2] - nominal[:, :2]).T).max())
    turned = float(np.abs(rows.z[:, 2:] - nominal[:, 2:]).max())
    checks.append(Check("largest departure of the object from the motion", log.times.size, away, "m"))
    checks.append(Check("largest departure of an axis from it", rows.z[:, 2:].size, turned, "rad or m"))
    if exact:
        checks += [
            _check_law(rows, motion, nominal, velocity, acceleration),
            _check_reports(rows, motion, problem),
        ]
        checks.append(_check_margin(rows, motion, nominal, velocity))
    return checks


def check_phases(rows: Rows, motion: Motion, *, exact: bool) -> Check:
    """Check that the phases of all robots are such as their words allow, and agree but for their clocks.

    With the pace rho, 0 <= rho <= 1, sigma' = rho and -kappa <= rho' <= alpha (1 - rho^2), kappa being that
    of the stops that may end after sigma; one that creeps to another one keeps |rho'| <= alpha (1 - rho^2).
    At phase 0 and at the end, where the motion is at rest, the pace may jump.

    Raises:
        RefusalError: Names the first entry for which a statement does not hold.
    """
    log, count = rows.log, len(rows.log.robot_names)
    if log.phases.shape != (len(log.times), count, 3):
        raise RefusalError(
            "phases", f"has the shape {log.phases.shape}; the plan's motion needs a phase a robot"
        )
    phase, pace, rate = np.moveaxis(log.phases, 2, 0)
    rows.require_same("phases", np.zeros((1, count, 3)), 0.0)
    last = log.phases[-1]
    if not np.abs(last - [motion.duration, 0.0, 0.0]).max() <= SAME:
        raise RefusalError(f"phases[{len(log.times) - 1}]", f"is {last.tolist()}; expected rest at the end")
    begins, ends = np.append(-np.inf, motion.windows[:-1, 0] + motion.waiting)[:-1], motion.windows[:-1, 1]
    acting = (begins <= phase[..., None] + SAME) & (phase[..., None] <= ends + SAME)
    stopping = (acting * motion.rates[:-1]).max(axis=2, initial=0.0)
    starting = motion.start_rate * (1.0 - pace * pace)
    held = (pace >= 0.0) & (pace <= 1.0)
    held &= (rate <= starting + SAME) & (rate >= -np.maximum(stopping, starting) - SAME)
    text = "is {:.9g} s with the pace {:.9g} and its rate {:.9g}; the words allow no such"
    rows.require(held, "phases", text, phase, pace, rate)
    h, hardest = rows.steps[:, None], max(motion.start_rate, float(motion.rates.max(initial=0.0)))
    went, paced = np.diff(phase, axis=0), np.diff(pace, axis=0)
    starts = (phase[:-1] == 0.0) & (pace[:-1] == 0.0)
    jumps = starts | (phase[1:] >= motion.duration - SAME)
    off = np.where(jumps, np.maximum(went - h, -went), np.abs(went - 0.5 * h * (pace[1:] + pace[:-1])))
    allowed = np.where(jumps, 0.0, 0.25 * h * h * hardest) + SAME
    text = "went on by {:.9g} s, which its paces do not allow"
    rows.require(
        (off <= allowed) & (jumps | (np.abs(paced) <= h * hardest + SAME)), "phases", text, went, first=1
    )
    parted = np.ptp(phase, axis=1)
    text = "of robots differ by {:.9g} s"
    eps = CLOCK_ERROR if rows.plan.budget is None else rows.plan.budget.clock_error
    rows.require(parted <= (0.0 if exact else 2.0 * eps) + SAME, "phases", text, parted)
    name = "phases are such as words allow, and those of all robots agree"
    return Check(name, phase.size, float(parted.max()), "s, largest difference", ("phases",))


def _check_cells(rows: Rows, motion: Motion, *, exact: bool) -> Check:
    """Check cells and their times by the phases, the stated intervals, and that a held team rests."""
    log, plan = rows.log, rows.plan
    least, most = log.phases[..., PHASE].min(axis=1), log.phases[..., PHASE].max(axis=1)
    bounds = np.array([[cell.lower, cell.upper] for cell in plan.cells])
    # By clocks that differ some robots may be in the next cell already.
    later = bounds if exact else np.append(bounds[1:], bounds[-1:], axis=0)
    for name, side in (("funnel_lower", 0), ("funnel_upper", 1)):
        own, following = bounds[log.cell_index, side], later[log.cell_index, side]
        stated = getattr(log, name)
        difference = np.minimum(np.abs(stated - own), np.abs(stated - following))
        rows.require(difference <= ROUNDING, name, "is {:.9g}; that of the cell is {:.9g}", stated, own)
    where = len(log.times) - 1
    if log.cell_index[-1] != len(plan.cells) - 1:
        raise RefusalError(f"cell_index[{where}]", f"is {log.cell_index[-1]}; expected the last cell")
    entered, windows = rows.entries, motion.windows
    rows.require_same("transition_start", np.append(0.0, log.times[entered])[log.cell_index], 0.0)
    since, left = least[entered] - windows[1:, 0], windows[:-1, 1] - most[entered]
    longest = WORD_PERIOD if exact else np.inf
    for k in np.flatnonzero((since < -SAME) | (left < -SAME) | (since > longest + SAME)):
        text = f"is entered at the phases {least[entered[k]]:.9g} s to {most[entered[k]]:.9g} s; the motion "
        text += f"is in both cells from {windows[k + 1, 0]:.9g} s to {windows[k, 1]:.9g} s"
        raise RefusalError(f"cell_index[{entered[k]}]", f"cell {k + 1} {text}")
    rows.require_same("clock_lag", np.zeros(len(log.times)), 0.0)
    rests = (log.held == 0.0) | ((log.held == 1.0) & (log.phases[..., PACE] == 0.0).all(axis=1))
    rows.require(rests, "held", "is {}; it is 1 only where all rest", log.held)
    arrays = ("cell_index", "transition_start", "funnel_lower", "funnel_upper", "clock_lag")
    name = "cells were entered while the motion lay in both, and stated intervals are theirs"
    return Check(
        name, len(entered), float(left.min(initial=np.inf)), "s, least time left in the earlier", arrays
    )


def motion_at_phases(motion: Motion, phases: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the motion, its rate and its acceleration at phases, (T, 3 + n) each; it rests after its end."""
    spline = BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)
    within, (pace, rate) = np.clip(phases[:, PHASE], 0.0, motion.duration), phases[:, PACE:].T[..., None]
    slope = spline(within, 1)
    return spline(within), pace * slope, pace * pace * spline(within, 2) + rate * slope


def _check_law(
    rows: Rows, motion: Motion, nominal: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> Check:
    """Check that position, angle and joints are accelerated along the motion, and pulled to it."""
    off, fast = rows.z - nominal, rows.rates - velocity
    gains = np.array(motion.gains)[np.minimum(np.arange(off.shape[1]) // 2, 1)]  # x, y, then theta and q
    expected = acceleration - gains[:, 0] * off - gains[:, 1] * fast
    difference = np.abs(rows.log.accelerations - expected)
    text = "the motion asks for {:.9g}, and the acceleration is {:.9g}"
    rows.require(difference <= DRIVEN, "accelerations", text, expected, rows.log.accelerations)
    name = "all axes were accelerated as the motion asks for"
    return Check(name, difference.size, float(difference.max()), "m/s² or rad/s², largest difference")


def _check_margin(rows: Rows, motion: Motion, nominal: FloatArray, velocity: FloatArray) -> Check:
    """Check Delta E of the departure from the motion."""
    log, margins = rows.log, np.empty(len(rows.log.times))
    for k, cell in enumerate(rows.plan.cells):
        members = log.cell_index == k
        margins[members] = signed_distances(cell.tidied, nominal[members, :2])
    fast = np.rint((rows.rates - velocity)[:, :2] / STEP) * STEP
    energy = 0.5 * (fast**2).sum(axis=1)
    energy += 0.5 * motion.gains[0][0] * ((rows.z - nominal)[:, :2] ** 2).sum(axis=1)
    margins = 0.5 * motion.gains[0][0] * margins * np.abs(margins) - energy
    rows.require_same("energy_margin", margins, SAME + STEP)
    rows.require(log.energy_margin >= 0.0, "energy_margin", "is {:.3g}, negative", log.energy_margin)
    name, least = "Delta E of the departure is right and never negative", float(margins.min())
    return Check(name, len(log.times), least, "m²/s², least", ("energy_margin",))


def _check_reports(rows: Rows, motion: Motion, problem: PlanningProblem) -> Check:
    """Check the reports: the phase since the next cell was entered, and in the last one arrival."""
    log, last = rows.log, len(rows.plan.cells) - 1
    entered = np.append(motion.windows[1:, 0], motion.duration)[log.cell_index]
    margins = log.phases[..., PHASE] - entered[:, None]
    members = log.cell_index == last
    of_object, of_axes = arriving(rows, members, problem.position_tolerance)
    joints = problem.tree.joints
    for k in range(len(log.robot_names)):
        own = of_axes[:, [0, *[1 + joint.index for joint in joints if joint.robot == k]]].min(axis=1)
        there, left = np.minimum(of_object, own), margins[members, k]
        margins[members, k] = np.where(left < 0.0, np.minimum(there, left), there)
    largest = rows.require_same("ready_margins", margins, SAME)
    name = "reports are those of the motion"
    return Check(name, margins.size, largest, "largest difference", ("ready_margins",))
