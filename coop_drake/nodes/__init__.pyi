from .one_process import DirectExchange, simulate_apart
from .processes import LocalTeam, robots_of, run_robot, run_supervisor
from .robot_node import RobotNode
from .supervisor_node import SupervisorNode
from .world_run import run_world, simulate_in_processes, simulate_world, wall_clock

__all__ = [
    "DirectExchange",
    "LocalTeam",
    "RobotNode",
    "SupervisorNode",
    "robots_of",
    "run_robot",
    "run_supervisor",
    "run_world",
    "simulate_apart",
    "simulate_in_processes",
    "simulate_world",
    "wall_clock",
]
