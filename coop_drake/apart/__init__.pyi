from .processes import (
    LocalTeam,
    SupervisorNode,
    network_of,
    robots_of,
    run_node,
    run_world,
    simulate_in_processes,
    wall_clock,
)
from .robot import RobotNode

REJOIN: float
RESTARTS: int

__all__ = [
    "LocalTeam",
    "RobotNode",
    "SupervisorNode",
    "network_of",
    "robots_of",
    "run_node",
    "run_world",
    "simulate_in_processes",
    "wall_clock",
]
