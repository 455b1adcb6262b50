"""The control laws as pure functions: arrays in, arrays out."""

from coop_drake.laws.funnels import Funnel, FunnelWalls, funnel_walls
from coop_drake.laws.gains import FixedGains, GainSet, ScheduledGains, TransitionGains
from coop_drake.laws.governor import (
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    tracking_energy,
)
from coop_drake.laws.load_sharing import (
    acceleration_at,
    grasp_matrix,
    object_twist,
    rotate,
    total_wrench,
    wrench_share,
)
from coop_drake.laws.ppc import funnel_acceleration, prescribed_acceleration, prescribed_energy
from coop_drake.laws.ready import arrival_margin, ready_margin
from coop_drake.laws.robot_effort import consistent_projector, robot_acceleration, robot_torque
from coop_drake.laws.schedule import transition_gains

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
