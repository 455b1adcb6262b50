from .one_process import DirectExchange, simulate_apart
from .robot_node import RobotNode
from .supervisor_node import SupervisorNode

__all__ = [
    "DirectExchange",
    "RobotNode",
    "SupervisorNode",
    "simulate_apart",
]
