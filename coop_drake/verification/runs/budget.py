"""Check by the log of a run that nothing departed from the plan's motion by more than the plan states."""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import Budget, Departures
from coop_drake.answers.motion import Motion
from coop_drake.robustness.tracking import allowed_departures
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.motion import motion_at_phases
from coop_drake.verification.runs.rows import Rows

ROUNDING = 1e-9
"""By how much a distance or rate that is computed again may differ from the logged one [m, rad, 1/s]."""

_FAR = "is {{:.6g}} {} from the motion; the plan's budget states {{:.6g}}"


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
    checks = []
    for one in departures_of_run(rows):
        held, values = np.ones((len(rows.log.times), one.found.shape[1]), dtype=np.bool_), []
        for array in (one.found, one.stated):
            values.append(np.zeros(held.shape))
            values[-1][one.rows] = array
        held[one.rows] = one.found <= one.stated + ROUNDING
        rows.require(held, one.array, one.finding, *values)
        checks.append(Check(one.statement, one.found.size, float(one.shares.max()), "of it used"))
    return checks


def largest_departure(rows: Rows, until: float = inf) -> Largest | None:
    """Return the largest departure of a run until some time [s]; None for a plan without a budget."""
    found = []
    for one in departures_of_run(rows):
        shares = one.shares[rows.log.times[one.rows] < until]
        if not shares.size:
            continue
        row, column = np.unravel_index(int(np.argmax(shares)), shares.shape)
        share, time = float(shares[row, column]), float(rows.log.times[one.rows[row]])
        found.append(Largest(share, one.what[int(column)], time))
    return max(found, default=None)


def budget_share(rows: Rows) -> float:
    """Return the largest share that a run used of what its plan's budget states [-]; NaN without one."""
    largest = largest_departure(rows)
    return nan if largest is None else largest.share


def departures_of_run(rows: Rows) -> list[Departure]:
    """Return all departures about which a plan with a budget states something."""
    if rows.plan.departures is None or rows.plan.motion is None or rows.plan.budget is None:
        return []
    return _from_motion(rows, rows.plan.motion, rows.plan.budget, rows.plan.departures)


def _from_motion(rows: Rows, motion: Motion, budget: Budget, stated: Departures) -> list[Departure]:
    """Return all departures from the mean of the robots' motions."""
    log, names = rows.log, ("the object's angle", *rows.log.joint_names)
    each = [motion_at_phases(motion, phases) for phases in np.moveaxis(log.phases, 1, 0)]
    nominal, velocity = np.mean([one[:2] for one in each], axis=0)
    off, fast = rows.z - nominal, rows.rates - velocity
    rates = np.column_stack([np.hypot(velocity[:, 0], velocity[:, 1]), np.abs(velocity[:, 2:])])
    near, steady = allowed_departures(motion, budget, stated)
    near = near + budget.clock_error * rates
    every, found = np.arange(len(log.times)), list[Departure]()
    for statement, array, what, away, most in (
        (
            "the object stayed as near to its motion as stated",
            "object_pose",
            "position",
            off,
            near,
        ),
        ("its velocity stayed as near to that of the motion", "object_twist", "velocity", fast, steady),
    ):
        values = np.hypot(away[:, 0], away[:, 1])[:, None]
        most = np.broadcast_to(most, (len(every), most.shape[-1]))[:, :1]
        found.append(
            Departure(statement, array, (f"the object's {what}",), _FAR.format("m, m/s"), values, most, every)
        )
    if not budget.axes:
        return found
    rated = tuple(f"the rate of {name}" for name in names)
    for statement, array, which, away, most in (
        ("axes stayed near their motion", "angle, joints", names, off, near),
        ("their rates stayed near those of the motion", "joint_rates", rated, fast, steady),
    ):
        values = np.abs(away[:, 2:])
        bounds = np.broadcast_to(most[..., 1:], values.shape)
        found.append(Departure(statement, array, which, _FAR.format("rad or m"), values, bounds, every))
    return found
