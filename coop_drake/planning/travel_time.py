"""The time of a transition by rule of thumb, for choices made before gains are known."""

from __future__ import annotations

from math import inf

SETTLING_TIME = 0.6
"""Time that angles and joints need at any distance, for choices made before gains are known [s]."""

SPEED_PER_CLEARANCE = 3.0
"""Speed over clearance with the paper's gains, for choices made before gains are known [1/s]."""


def travel_time(length: float, clearance: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Return the time that the object needs for a path with the same clearance everywhere [s].

    Args:
        length: L, length of the path to the target [m].
        clearance: b, clearance that the path keeps [m].
        speed: Speed over clearance [1/s].
    """
    return length / (speed * clearance) if clearance > 0.0 else inf


def transition_time(length: float, clearance: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Return an approximate time of one transition, ``SETTLING_TIME`` more than its travel [s]."""
    return SETTLING_TIME + travel_time(length, clearance, speed)
