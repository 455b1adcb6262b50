"""How a team begins its current cell anew from rest: slowly, on a straight way to the middle of its goals.

Every axis goes from where it rests to the middle of its goal interval, in the same time for all axes of the
team, by

    x(t) = x_0 + (x_1 - x_0) s(t / S),   s(r) = 10 r^3 - 15 r^4 + 6 r^5,

whose largest rate is 1.875 |x_1 - x_0| / S and whose largest acceleration 5.774 |x_1 - x_0| / S^2. Meanwhile
the object's position rests, or returns to its cell in the same way where it is outside. Then the cell's law
takes over: its funnels are closed about the axes, and p_G goes to the target.

A cell is convex in its axes: from a rest inside the slices the way lies inside. What the plan states about
such rests is in ``answers/budget.py``.
"""

from __future__ import annotations

from math import ceil, sqrt

from coop_drake.laws.axis_table import DECAY_RATE, FADING_TIME, RAMP_RATE
from coop_drake.laws.funnels import CLOSING
from coop_drake.tree.pose import FloatArray

RATE = 0.4
"""Largest rate of an axis on the way, and largest speed of the object [rad/s or m/s]: a fifth to a tenth of
what funnels ask for, so that rates and errors of masses cause little."""

ACCELERATION = 1.0
"""Largest acceleration of an axis on the way [rad/s^2 or m/s^2]."""

USED = 0.9
"""Share of both for which the time is chosen [-]: the rest is for what a motion makes up for on its way."""

PULL = (100.0, 20.0)
"""Stiffness [1/s^2] and damping [1/s] with which an axis is kept on the way."""

LONGEST_RETURN = 0.3
"""Longest way on which an object outside its cell returns [m]: braked teams coast by less."""

WIDEST_RETURN = 1.0
"""Longest way of an axis to its slice, over the slice's width [-]: farther away no certificate says anything
about what is free."""

RAMPED = 6.0
"""mu t from which on the gain k1 counts as ramped in [-], as in the plan's budget."""


def slow_samples(distance: float, period: float, share: float = 1.0) -> int:
    """Return how many periods a way takes [-].

    Args:
        distance: Largest distance of an axis, or of the object [rad or m].
        period: T [s].
        share: Share of rate and acceleration that the plan allows [-].
    """
    used = USED * share
    time = max(1.875 * distance / (used * RATE), sqrt(5.774 * distance / (used * ACCELERATION)))
    return ceil(time / period) + 1


def slow_motion(ends: FloatArray, time: float, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, x' and x'' at a time of the way, each of shape (m,).

    Args:
        ends: x_0 and x_1, shape (2, m) [rad or m].
        time: t, any; before 0 and after S all rest [s].
        duration: S [s].
    """
    r, way = min(max(time / duration, 0.0), 1.0), ends[1] - ends[0]
    share = r**3 * (10.0 - 15.0 * r + 6.0 * r * r)
    rate = 30.0 * r * r * (1.0 - r) ** 2 / duration
    acceleration = 60.0 * r * (1.0 - r) * (1.0 - 2.0 * r) / duration**2
    return ends[0] + share * way, rate * way, acceleration * way


def closed_after(table: FloatArray) -> float:
    """Return the time after which all funnels of a cell are closed, gains ramped and jumps faded [s].

    Args:
        table: The axes in the cell, an ``axis_table``.
    """
    closed = (CLOSING / table[:, DECAY_RATE]).max()
    ramped = max((RAMPED / rate for rate in table[:, RAMP_RATE] if rate > 0.0), default=0.0)
    return float(max(closed, ramped, table[:, FADING_TIME].max()))
