"""How long a transport will take, estimated before it is simulated."""

from __future__ import annotations

from coop_drake.planning.plan import Plan

__all__ = ["SETTLING_TIME", "SPEED_PER_CLEARANCE", "plan_time", "transition_time", "travel_time"]

SETTLING_TIME = 0.6
"""Time that angles and joints need whatever the distance, measured on transports in Drake [s]."""

SPEED_PER_CLEARANCE = 3.0
"""Speed of the governed object over its clearance, measured on transports in Drake [1/s]."""


def transition_time(length: float, neck: float) -> float:
    """Estimate the duration of one transition, 0.6 s + L / (3 b).

    Args:
        length: L, length of the path to the target [m].
        neck: b, clearance that the path keeps [m].
    """
    return SETTLING_TIME + travel_time(length, neck)


def travel_time(length: float, neck: float) -> float:
    """Estimate the time that the object itself needs for a path, L / (3 b) [s]."""
    return length / (SPEED_PER_CLEARANCE * neck)


def plan_time(plan: Plan) -> float:
    """Estimate the duration of the whole transport [s]."""
    return sum(transition.estimated_time for transition in plan.transitions)
