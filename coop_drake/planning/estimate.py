"""How long a transport will take, estimated before it is simulated."""

from __future__ import annotations

from math import inf, sqrt

from coop_drake.control import TransitionGains
from coop_drake.planning.plan import Plan

__all__ = [
    "SETTLING_TIME",
    "SPEED_PER_CLEARANCE",
    "plan_time",
    "speed_per_clearance",
    "transition_time",
    "travel_time",
]

SETTLING_TIME = 0.6
"""Time that angles and joints need whatever the distance, measured on transports in Drake [s]."""

SPEED_PER_CLEARANCE = 3.0
"""Speed over clearance with the paper's gains, for choices that are made before gains are [1/s]."""


def speed_per_clearance(gains: TransitionGains) -> float:
    """Speed of the governed object in a long aisle over its clearance there.

    At a steady speed v behind the governor (14)-(16) the object lags by zeta v / K, so that
    E = v^2 (1 + zeta^2 / K) / 2, and v = K_G sqrt(Delta E / K) gives
    v / d = sqrt(K / (2 K / K_G^2 + 1 + zeta^2 / K)).

    Args:
        gains: Gains of the transition.

    Returns:
        v / d [1/s].
    """
    K, K_G, zeta = gains.stiffness, gains.governor_gain, gains.damping
    return sqrt(K / (2.0 * K / K_G**2 + 1.0 + zeta**2 / K))


def travel_time(length: float, neck: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Estimate the time that the object itself needs for a path [s].

    Args:
        length: L, length of the path to the target [m].
        neck: b, clearance that the path keeps [m].
        speed: Speed over clearance [1/s].
    """
    return length / (speed * neck) if neck > 0.0 else inf


def transition_time(length: float, neck: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Estimate the duration of one transition, 0.6 s more than its travel [s]; arguments as above."""
    return SETTLING_TIME + travel_time(length, neck, speed)


def plan_time(plan: Plan) -> float:
    """Estimate the duration of the whole transport [s]."""
    return sum(transition.estimated_time for transition in plan.transitions)
