"""How far the team can get between two rows of a log.

A log says nothing about the time between its rows. The checks assume that there no coordinate's acceleration
exceeds ``ACCELERATION_FACTOR`` times the largest one logged for it at the two rows and at their neighbours,
or ``ACCELERATION_SHARE`` of the largest one in the run, whichever is larger. With that bound A and a step h

- a rate changes by no more than h A,
- the change of a position differs from h times the mean of both rates by no more than h^2 A / 4,
- the path differs from the chord between both positions by no more than h^2 A / 8.

The first two are checked; where they fail, a number was altered or the log is too sparse. The third says how
far from the chord bodies may be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Rows

ACCELERATION_FACTOR = 3.0
"""An acceleration between two rows may exceed those at the rows by this factor [-]. In logs of the shipped
scenarios a factor of 1.5 explains all positions; the law's accelerations jump where a cell is entered."""

ACCELERATION_SHARE = 0.02
"""Where a coordinate hardly moves, efforts that are held for a control period accelerate it more between two
rows than at them, because the others move: by up to a hundredth of its largest acceleration [-]."""

ROUNDING = 1e-9
"""Numbers that are computed twice may differ by so much [m, rad, 1/s]."""


@dataclass(frozen=True)
class Between:
    """Bounds for the time between every row and the next; T - 1 of them, for all 3 + n coordinates.

    Attributes:
        accelerations: Largest magnitudes of accelerations, shape (T - 1, 3 + n) [m/s^2, rad/s^2].
        speeds: Largest magnitudes of rates, shape (T - 1, 3 + n) [m/s, rad/s].
        deviations: Largest distances from the chord, shape (T - 1, 3 + n) [m, rad].
    """

    accelerations: FloatArray
    speeds: FloatArray
    deviations: FloatArray

    @classmethod
    def of(cls, rows: Rows) -> Between:
        """The bounds of a log."""
        logged = np.abs(rows.log.accelerations)
        either = np.maximum(logged[1:], logged[:-1])
        around = either.copy()
        around[1:] = np.maximum(around[1:], either[:-1])
        around[:-1] = np.maximum(around[:-1], either[1:])
        floor = ACCELERATION_SHARE * logged.max(axis=0)
        accelerations, h = np.maximum(ACCELERATION_FACTOR * around, floor), rows.steps[:, None]
        rates = np.abs(rows.rates)
        speeds = np.maximum(rates[1:], rates[:-1]) + 0.5 * h * accelerations
        return cls(accelerations, speeds, 0.125 * h * h * accelerations)


def check_motion(rows: Rows, between: Between) -> Check:
    """Check that rates are derivatives of positions, and accelerations those of rates, within the bounds."""
    h, z, rates = rows.steps[:, None], rows.z, rows.rates
    change = np.abs(np.diff(rates, axis=0))
    residual = np.abs(np.diff(z, axis=0) - 0.5 * h * (rates[1:] + rates[:-1]))
    allowed = 0.25 * h * h * between.accelerations + ROUNDING
    for name, what, values, bounds in (
        ("object_twist, joint_rates", "rate changed", change, h * between.accelerations + ROUNDING),
        ("object_pose, joints", "position differs from that by its rates", residual, allowed),
    ):
        text = (
            f"since the row before a {what} by {{:.3g}}, more than the {{:.3g}} that accelerations allow: a "
            "number was altered, or the log is too sparse"
        )
        rows.require(values <= bounds, name, text, values, bounds, first=1)
    tightest = float((residual / allowed).max(initial=0.0))
    name = "rates are derivatives of positions, accelerations of rates"
    arrays = "times", "object_pose", "object_twist", "joints", "joint_rates"
    return Check(name, 2 * z.size, tightest, "of the bound", arrays)
