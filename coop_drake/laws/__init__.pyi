from .axis_table import funnel_acceleration
from .funnels import Funnel, FunnelBounds, funnel_bounds
from .gain_schedule import transition_gains
from .gains import FixedGains, GainSet, ScheduledGains, TransitionGains
from .governor import (
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    tracking_energy,
)
from .load_sharing import acceleration_at, object_twist, total_wrench, wrench_share
from .ppc import prescribed_acceleration, prescribed_energy
from .readiness import clearance_margin, interval_margin

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
    "object_twist",
    "prescribed_acceleration",
    "prescribed_energy",
    "slowdown_radius",
    "total_wrench",
    "tracking_energy",
    "transition_gains",
    "wrench_share",
]
