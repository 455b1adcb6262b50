"""The nominal motion of a plan whose team passes from cell to cell without a stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from coop_drake.tree.arrays import FloatArray
from coop_drake.typed_data import EXACT, Codec, DataError, NotNegative, Number, Positive, Vector

FEWEST_POINTS = 7
"""Control points of the shortest motion: three at rest at either end, and one between."""

BASE_SPEED, TURN_RATE, BASE_ACCELERATION, TURN_ACCELERATION, BASE_JERK = 1.0, 1.5, 1.0, 2.0, 10.0
"""Limits of bases of which nothing is known [m/s, rad/s, m/s^2, rad/s^2, m/s^3]."""

FRICTION, GRAVITY = 0.5, 9.81
"""Largest force of a base over the weight of what it moves, where nothing is known [-]; and g [m/s^2]."""

JOINT_RATE, JOINT_ACCELERATION, OBJECT_ACCELERATION = 1.0, 2.0, 1.5
"""Limits of joints and of the object of which nothing is known [rad/s, rad/s^2; m/s, m/s^2; m/s^2]."""

USUAL_LIMITS = (
    f"bases {BASE_SPEED:g} m/s, {TURN_RATE:g} rad/s, {BASE_ACCELERATION:g} m/s^2, "
    f"{TURN_ACCELERATION:g} rad/s^2, {BASE_JERK:g} m/s^3 and a force of {FRICTION:g} of the weight that they "
    f"move; joints {JOINT_RATE:g} rad/s and {JOINT_ACCELERATION:g} rad/s^2; the object "
    f"{OBJECT_ACCELERATION:g} m/s^2"
)
"""These limits in words."""

WAITING = 0.128
"""2 W for words that are up to 50 ms old, clocks that are 2 ms off and a control period of 5 ms [s]:
W = 50 ms + 2 * 2 ms + 2 * 5 ms."""

LARGEST_DAMPING, AGE_PHASE = 20.0, 0.4
"""Largest zeta_t [1/s], and largest product of zeta_t and the age of the commands [rad]. K_t = zeta_t^2 / 4:
the feedback is critically damped."""


def _read_rows(rows: tuple[tuple[float, ...], ...]) -> FloatArray:
    lengths = {len(row) for row in rows}
    if len(rows) < FEWEST_POINTS or len(lengths) != 1:
        allowed = f"a list of at least {FEWEST_POINTS} lists of equal length"
        raise DataError("", [list(row) for row in rows[:3]], allowed)
    return np.array(rows, dtype=np.float64)


Windows = Annotated[FloatArray, Codec(tuple[tuple[Number, Number], ...], np.array, np.ndarray.tolist)]

Gains = tuple[Annotated[Positive, EXACT], Annotated[Positive, EXACT]]

TeamGains = tuple[Gains, Gains]

ControlPoints = Annotated[FloatArray, Codec(tuple[tuple[Number, ...], ...], _read_rows, np.ndarray.tolist)]


@dataclass(frozen=True)
class Motion:
    """One motion of the whole team through all cells: a cubic B-spline with equal spans, from rest to rest.

    With p_0 ... p_(m-1) the control points and h the length of a span, the motion at the knot t = k h is
    (p_k + 4 p_(k+1) + p_(k+2)) / 6, its velocity (p_(k+2) - p_k) / (2 h), and its acceleration
    (p_k - 2 p_(k+1) + p_(k+2)) / h^2, which is linear between knots.

    It is made so that robots can tell each other that they have begun cell i at the time tau_i, at which the
    motion enters it, and that all can brake at tau_i + 2 W if somebody has not heard it of all: the pace
    falls from 1 at the rate kappa_i, reached within r, and they rest before the motion leaves cell i.

    Attributes:
        points: Control points z = (x, y, theta, q...), the first three equal, the last three equal, shape
            (m, 3 + n) [m, rad].
        period: h [s].
        windows: tau_i, when the motion enters every cell, and x_i, when it leaves it, shape (cells, 2) [s].
        rates: kappa_i, zero for the last cell, which is not left, shape (cells,) [1/s].
        waiting: 2 W [s].
        ramp: r [s].
        start_rate: alpha, with which the pace rises where the team starts again on the way [1/s].
        gains: K_t [1/s^2] and zeta_t [1/s], with which robots pull the object's position to the motion, then
            those for its angle and the joints.
    """

    points: ControlPoints
    period: Annotated[Positive, EXACT]
    windows: Windows
    rates: Vector
    waiting: Annotated[NotNegative, EXACT]
    ramp: Annotated[Positive, EXACT]
    start_rate: Annotated[Positive, EXACT]
    gains: TeamGains

    @property
    def run_time(self) -> float:
        """How long a run without holds takes [s]: the words of its start, 3 W, then the motion."""
        return self.duration + 1.5 * self.waiting

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return (len(self.points) - 3) * self.period


def cell_times(motion: Motion) -> FloatArray:
    """Return the times from entry to entry, in the last cell to the end, shape (cells,) [s]."""
    return np.diff(motion.windows[:, 0], append=motion.duration)


def pull_gains(age: float) -> TeamGains:
    """Return K_t and zeta_t of a team without a budget, for position and axes alike.

    Args:
        age: How old commands are when they act: what is measured, computed, and followed with a lag [s].
    """
    damping = min(LARGEST_DAMPING, AGE_PHASE / age) if age > 0.0 else LARGEST_DAMPING
    gains = 0.25 * damping * damping, damping
    return gains, gains
