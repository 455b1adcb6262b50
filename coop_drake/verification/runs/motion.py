"""Check what a run states about the motion of its plan, where the team passes from cell to cell."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from coop_drake.answers.motion import Motion
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.laws import DRIVEN, ROUNDING, SAME, STEP, arriving, signed_distances
from coop_drake.verification.runs.rows import Rows


def check_followed(rows: Rows, problem: PlanningProblem, *, exact: bool) -> list[Check]:
    """Check that the team followed the motion of its plan.

    Args:
        rows: The log of a run whose plan has a motion.
        problem: The question.
        exact: Whether the team is ideal, so that the law's equations hold to rounding.

    Raises:
        RefusalError: Names the first entry for which a statement does not hold.
    """
    motion = rows.plan.motion
    assert motion is not None  # the caller asks for no other run
    log, plan = rows.log, rows.plan
    nominal, velocity, acceleration = _at(motion, log.times)
    bounds = np.array([[cell.lower, cell.upper] for cell in plan.cells])[log.cell_index]
    largest = max(
        rows.require_same("funnel_lower", bounds[:, 0], ROUNDING),
        rows.require_same("funnel_upper", bounds[:, 1], ROUNDING),
    )
    arrays = ("funnel_lower", "funnel_upper")
    checks = [
        Check("stated funnels are the cells", 2 * bounds[:, 0].size, largest, "largest difference", arrays)
    ]
    largest = rows.require_same("governor_position", nominal[:, :2], SAME)
    rows.require_same("governor_spread", np.zeros(len(log.times)), SAME)
    arrays = ("governor_position", "governor_spread")
    checks.append(Check("the reference is the plan's motion", log.times.size, largest, "m, largest", arrays))
    entered, windows = log.times[rows.entries], motion.windows
    late, left = entered - windows[1:, 0], windows[:-1, 1] - entered
    for k in np.flatnonzero((late < -SAME) | (left < -SAME)):
        text = f"is entered at {entered[k]:.9g} s; the motion is in both cells from {windows[k + 1, 0]:.9g} s"
        raise RefusalError(f"cell_index[{rows.entries[k]}]", f"cell {k + 1} {text} to {windows[k, 1]:.9g} s")
    name = "cells were entered while the motion lay in both cells"
    checks.append(
        Check(name, len(entered), float(left.min(initial=np.inf)), "s, least time left in the earlier cell")
    )
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


def _at(motion: Motion, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the motion, its rate and its acceleration, (T, 3 + n) each; it rests after its end."""
    spline = BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)
    within = np.clip(times, 0.0, motion.duration)
    moving = (times < motion.duration)[:, None]
    return spline(within), moving * spline(within, 1), moving * spline(within, 2)


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
    """Check the reports: the time since the next cell was entered, and in the last one arrival."""
    log, last = rows.log, len(rows.plan.cells) - 1
    entered = np.append(motion.windows[1:, 0], motion.duration)[log.cell_index]
    margins = np.repeat((log.times - entered)[:, None], len(log.robot_names), axis=1)
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
