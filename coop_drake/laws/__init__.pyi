from .axis_table import funnel_acceleration
from .gains import FixedGains, GainSet, ScheduledGains, TransitionGains, transition_gains
from .governor import (
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    tracking_energy,
)
from .ppc import Funnel, FunnelBounds, funnel_bounds
from .readiness import clearance_margin, interval_margin
from .robot_dynamics import acceleration_at, total_wrench, wrench_share

__all__ = [
    "FixedGains",
    "Funnel",
    "FunnelBounds",
    "GainSet",
    "ScheduledGains",
    "TransitionGains",
    "acceleration_at",
    "clearance_margin",
    "energy_margin",
    "funnel_acceleration",
    "funnel_bounds",
    "governed_acceleration",
    "governor_velocity",
    "interval_margin",
    "slowdown_radius",
    "total_wrench",
    "tracking_energy",
    "transition_gains",
    "wrench_share",
]
