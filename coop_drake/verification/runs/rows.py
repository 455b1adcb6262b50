"""The rows of a log as the checks read them, and how far a team can get between two of them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.verification.checks import Check

# What a run's log cannot state itself: its scenario's settings, and the masses of the bodies.


@dataclass(frozen=True)
class BodyMass:
    """Mass properties of one body in the plane.

    Attributes:
        component: Index of its component in the team's tree.
        robot: Index of the robot that it belongs to, None for the object's bodies.
        mass: Mass [kg].
        p_CBcm: Centre of mass in the component's frame, shape (2,) [m].
        inertia: About the vertical axis through the centre of mass [kg m^2].
    """

    component: int
    robot: int | None
    mass: float
    p_CBcm: FloatArray  # noqa: N815
    inertia: float


@dataclass(frozen=True)
class RunSetup:
    """A scenario as the check of a log needs it.

    Attributes:
        scenario_digest: Digest of the scenario.
        robot_names: Names of the robots.
        exact: Whether the team is ideal, so that the equations of the control law hold to rounding.
        rigid: Whether grasps are exactly rigid.
        mechanics: Whether grasps are rigid and nothing but actuators, damping and friction of joints, and
            grasps acts on the bodies, so that the equations of motion hold to rounding.
        can_be_held: Whether the scenario knows holds.
        one_hold: Whether all robots hear at once that they are held, and not.
        one_clock: Whether all robots have the same time since a cell was entered, but for holds.
        alike: Whether they also compute at the same instants, so that all have the same nominal motions.
        grasps: Every robot's grasp in L, shape (N, 2) [m].
        bodies: Mass properties of all bodies.
        joint_damping: Of every joint, shape (n,) [N m s or N s/m].
        joint_friction: Largest dry friction of a joint [N m or N], and its friction for each unit of the rate
            besides [N m s or N s/m].
        joint_inertia: That the joint's rotor adds, shape (n,) [kg m^2 or kg].
        displacement: How far the team stands off the plan's start, shape (3 + n,) [m, rad].
    """

    scenario_digest: str
    robot_names: tuple[str, ...]
    exact: bool
    rigid: bool
    mechanics: bool
    can_be_held: bool
    one_hold: bool
    one_clock: bool
    alike: bool
    grasps: FloatArray
    bodies: tuple[BodyMass, ...]
    joint_damping: FloatArray
    joint_friction: tuple[float, float]
    joint_inertia: FloatArray
    displacement: FloatArray


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

    def require_same(self, name: str, expected: FloatArray, tolerance: float | FloatArray) -> float:
        """Refuse the first number of an array that is not what it should be; return the largest difference.

        Args:
            name: Name of the log's array.
            expected: Values of the first rows.
            tolerance: Largest difference, one for all or one for each entry.
        """
        stated = np.asarray(getattr(self.log, name), dtype=float)[: len(expected)]
        same = stated == expected  # also where both are infinite
        difference = np.abs(np.subtract(stated, expected, where=~same, out=np.zeros(stated.shape)))
        text = "is {:.9g}; expected {:.9g}"
        self.require(difference <= tolerance, name, text, stated, expected)
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


# How far the team can get between two rows of a log.
#
# A log says nothing about the time between its rows. The checks assume that there no coordinate's
# acceleration exceeds ``ACCELERATION_FACTOR`` times the largest one logged for it at the two rows and at
# their neighbours, or ``ACCELERATION_SHARE`` of the largest one in the run, whichever is larger. With that
# bound A and a step h
#
# - a rate changes by no more than h A,
# - the change of a position differs from h times the mean of both rates by no more than h^2 A / 4,
# - the path differs from the chord between both positions by no more than h^2 A / 8.
#
# The first two are checked; where they fail, a number was altered or the log is too sparse. The third says
# how far from the chord bodies may be.

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
