"""The rows of a log as the checks read them, and how a check refuses one of them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.checks import Check


@dataclass(frozen=True)
class Rows:
    """A log with its plan. Coordinates are z = (x, y, theta, q...), axes are (theta, q...).

    Attributes:
        log: The log, T rows.
        plan: The plan that it followed.
    """

    log: SimulationLog
    plan: Plan

    @cached_property
    def z(self) -> FloatArray:
        """Configurations, shape (T, 3 + n) [m, rad]."""
        return np.hstack([self.log.object_pose, self.log.joints])

    @cached_property
    def rates(self) -> FloatArray:
        """Rates of the configurations, shape (T, 3 + n)."""
        return np.hstack([self.log.object_twist, self.log.joint_rates])

    @cached_property
    def steps(self) -> FloatArray:
        """Time from every row to the next, shape (T - 1,) [s]."""
        return np.diff(self.log.times)

    @cached_property
    def entries(self) -> IntArray:
        """The last row in every cell but the last, at which the next cell is entered, shape (cells - 1,)."""
        return np.flatnonzero(np.diff(self.log.cell_index))

    @cached_property
    def motions(self) -> tuple[tuple[IntArray, int], ...]:
        """For every cell the rows between which it is the current one, with the row of its entry."""
        first = np.concatenate(([0], self.entries))
        last = np.concatenate((self.entries, [len(self.log.times) - 1]))
        return tuple((np.arange(a, b + 1), k) for k, (a, b) in enumerate(zip(first, last, strict=True)))

    def require(
        self, held: NDArray[np.bool_], name: str, finding: str, *values: FloatArray, first: int = 0
    ) -> None:
        """Refuse the first entry of an array for which a statement does not hold.

        Args:
            held: For every entry whether it holds; its first axis are rows.
            name: Name of the log's array.
            finding: What is wrong, with a place for each of the values.
            values: Arrays of which the entries at the same index stand in the finding.
            first: The log's row that the first entry belongs to.

        Raises:
            RefusalError: With array, index and time.
        """
        if held.all():
            return
        at = tuple(int(i) for i in np.argwhere(~held)[0])
        place = ", ".join(str(i) for i in (first + at[0], *at[1:]))
        text = finding.format(*(array[at] for array in values))
        raise RefusalError(f"{name}[{place}]", f"at t = {self.log.times[first + at[0]]:.6g} s: {text}")

    def require_same(
        self, name: str, expected: FloatArray, tolerance: float | FloatArray, first: int = 0
    ) -> float:
        """Refuse the first number of an array that is not what it should be; return the largest difference.

        Args:
            name: Name of the log's array.
            expected: Values from row ``first`` on.
            tolerance: Largest difference, one for all or one for each entry.
            first: The log's row that the first value belongs to.
        """
        stated = np.asarray(getattr(self.log, name), dtype=float)[first : first + len(expected)]
        same = stated == expected  # also where both are infinite
        difference = np.abs(np.subtract(stated, expected, where=~same, out=np.zeros(stated.shape)))
        text = "is {:.9g}; expected {:.9g}"
        self.require(difference <= tolerance, name, text, stated, expected, first=first)
        return float(difference.max(initial=0.0))


def check_complete(rows: Rows) -> Check:
    """Check that every number is one, that time passes, and that cells follow one another from the first."""
    log, count = rows.log, 0
    for field in fields(log):
        values = np.asarray(getattr(log, field.name))
        if values.dtype.kind in "fi" and values.ndim > 0:
            count += values.size
            finite = ~np.isnan(values) if field.name == "body_clearance" else np.isfinite(values)
            rows.require(finite, field.name, "is {}; expected a finite number", values)
    if log.times[0] != 0.0:
        raise RefusalError("times[0]", f"is {log.times[0]} s; expected 0")
    rows.require(rows.steps > 0.0, "times", "is not after the row before", first=1)
    jumps = np.diff(log.cell_index, prepend=0)
    follow = (jumps == 0) | ((jumps == 1) & (log.times > 0.0))
    text = "is {}, neither the cell of the row before nor the next one"
    rows.require(follow, "cell_index", text, log.cell_index.astype(float))
    return Check("every number is finite, time passes, cells follow one another", count)
