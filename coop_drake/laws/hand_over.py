"""Hand-overs without steps: accelerations and gains go smoothly from the last cell's to the next one's.

At a switch the law of the next cell asks for other accelerations than the law of the last one does. An axis
adds the difference, found at the switch, to its new law, and lets it fade; the governor's gains move from the
old values to the new ones. Fading takes the time T of the next transition. A robot is ready to leave a cell
only after T, so that the law is pure again at the next switch.
"""

from __future__ import annotations

from math import log

from coop_drake.jit import compiled
from coop_drake.laws.funnels import CLOSING, STEEPEST, decay_factor
from coop_drake.tree.pose import FloatArray

STIFFNESS, DAMPING, GOVERNOR_GAIN, SMOOTHING = range(4)
"""Columns of a governor's row: the gains of the cell, c [m] ..."""

FIRST_STIFFNESS, FIRST_DAMPING, FIRST_GOVERNOR_GAIN, HAND_OVER_TIME = range(4, 8)
"""... and the gains of the cell before it, from which they start, and T [s] ..."""

SPEED_LIMIT = 8
"""... and the largest speed of the object, infinity for none [m/s]."""


@compiled
def fading(time: float, duration: float) -> float:
    """Return the factor that falls from 1 to 0 within T, as a quintic funnel closes; 0 where T is 0 [-].

    Args:
        time: Time since the cell was entered [s].
        duration: T [s].
    """
    return decay_factor(time, CLOSING / duration, True)[0] if time < duration else 0.0


@compiled(borrows=True)
def governed_gains(row: FloatArray, time: float) -> tuple[float, float, float]:
    """Return K, zeta and K_G now: K = K_1 (K_0 / K_1)^f with f of ``fading``, and so for the others.

    With e = p - p_G and Delta E of (15), for d > 0,

        Delta E' = (K' / K) Delta E + (zeta + K' / (2 K)) |p'|^2 + K (d d' + e . p_G').

    Where Delta E is zero p_G stands still, and Delta E cannot fall below zero while zeta >= -K' / (2 K): K
    may rise at any rate, and fall as slowly as ``shortest_hand_over`` sees to.

    Args:
        row: A governor's row, shape (9,).
        time: Time since the cell was entered [s].

    Returns:
        K [1/s^2], zeta [1/s] and K_G [-].
    """
    left = fading(time, row[HAND_OVER_TIME])
    if left == 0.0:
        return row[STIFFNESS], row[DAMPING], row[GOVERNOR_GAIN]
    return (
        row[STIFFNESS] * (row[FIRST_STIFFNESS] / row[STIFFNESS]) ** left,
        row[DAMPING] * (row[FIRST_DAMPING] / row[DAMPING]) ** left,
        row[GOVERNOR_GAIN] * (row[FIRST_GOVERNOR_GAIN] / row[GOVERNOR_GAIN]) ** left,
    )


def shortest_hand_over(largest_stiffness: float, smallest_stiffness: float, smallest_damping: float) -> float:
    """Return the shortest T in which K may fall [s]: -K' / (2 K) <= 1.875 ln(K_0 / K_1) / (2 T) <= zeta.

    Args:
        largest_stiffness: K_0 [1/s^2].
        smallest_stiffness: K_1 [1/s^2].
        smallest_damping: Smallest zeta on the way [1/s].
    """
    return 0.5 * STEEPEST * log(largest_stiffness / smallest_stiffness) / smallest_damping
