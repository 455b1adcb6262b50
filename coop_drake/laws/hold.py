"""How the funnels' clock slows down, stands still and runs again, so that a team rests inside its cell.

While a team is held, h = 1, else h = 0. The clock's pace 1 - b follows h through two lags of first order with
the same rate omega,

    a' = omega (h - a),   b' = omega (a - b),

which keep a and b in [0, 1] whenever h changes. Pace and its derivative are therefore continuous, and so are
the bounds, their rates and their accelerations: with tau' = 1 - b the bound rho(tau(t)) has the rate
rho' tau' and the acceleration rho'' tau'^2 + rho' tau''. The energy argument of ``track_axis`` holds for any
bounds. The rate of p_G is multiplied by the pace; where Delta E is zero it is zero with any pace, so that
Delta E does not become negative.
"""

from __future__ import annotations

from math import exp

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

HOLD_RATE = 10.0
"""omega [1/s]: after a hold begins the clock loses its pace gradually, and advances by 2 / omega = 0.2 s in
all. A quicker one would ask for larger accelerations of the bounds than the funnels themselves."""

SETTLING_TIME = 1.0
"""So long after a hold the clock's pace is 1 for all purposes [s]: at 10 / omega, b is below a thousandth."""


def lagging_clock(time: float, held: float, start: FloatArray) -> tuple[float, float, float, float]:
    """Return a, b, b' and the time that the clock loses, in closed form while h is constant.

    Args:
        time: Time since h changed last [s].
        held: h, 1 where the team is held and 0 where it is not [-].
        start: a, b and the time lost so far, when h changed, shape (3,).

    Returns:
        a [-], b [-], b' [1/s] and the time lost [s].
    """
    left = exp(-HOLD_RATE * time)
    first, second = start[0] - held, start[1] - held
    a = held + first * left
    b = held + (second + HOLD_RATE * time * first) * left
    gone = (1.0 - left) / HOLD_RATE
    lost = held * time + second * gone + first * (gone - time * left)
    return a, b, HOLD_RATE * (a - b), start[2] + lost


@compiled(borrows=True)
def slowed_bounds(
    bounds: tuple[float, float, float, float, float, float], pace: float, pace_rate: float
) -> tuple[float, float, float, float, float, float]:
    """Return the bounds of ``axis_bounds`` with their rates and accelerations on a clock that runs slower.

    Args:
        bounds: Bounds, their rates and accelerations by the clock's own time.
        pace: tau' [-].
        pace_rate: tau'' [1/s].
    """
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds
    return (
        lower,
        upper,
        lower_rate * pace,
        upper_rate * pace,
        lower_acceleration * pace * pace + lower_rate * pace_rate,
        upper_acceleration * pace * pace + upper_rate * pace_rate,
    )
