from .funnels import Funnel, FunnelWalls, funnel_walls
from .gains import FixedGains, GainSet, ScheduledGains, TransitionGains
from .governor import (
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    tracking_energy,
)
from .load_sharing import acceleration_at, grasp_matrix, object_twist, rotate, total_wrench, wrench_share
from .ppc import funnel_acceleration, prescribed_acceleration, prescribed_energy
from .ready import arrival_margin, ready_margin
from .robot_effort import consistent_projector, robot_acceleration, robot_torque
from .schedule import transition_gains

__all__ = [
    "FixedGains",
    "Funnel",
    "FunnelWalls",
    "GainSet",
    "ScheduledGains",
    "TransitionGains",
    "acceleration_at",
    "arrival_margin",
    "consistent_projector",
    "energy_margin",
    "funnel_acceleration",
    "funnel_walls",
    "governed_acceleration",
    "governor_velocity",
    "grasp_matrix",
    "object_twist",
    "prescribed_acceleration",
    "prescribed_energy",
    "ready_margin",
    "robot_acceleration",
    "robot_torque",
    "rotate",
    "slowdown_radius",
    "total_wrench",
    "tracking_energy",
    "transition_gains",
    "wrench_share",
]
