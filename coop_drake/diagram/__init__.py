"""Wiring: one robot's controller, the transport station, the closed loop."""

from coop_drake.diagram.closed_loop import Blocks, ClosedLoop, build_closed_loop
from coop_drake.diagram.robot_controller import (
    TELEMETRY,
    Replacements,
    RobotKnowledge,
    build_robot_controller,
)
from coop_drake.diagram.station import TransportStation, build_station

__all__ = [
    "TELEMETRY",
    "Blocks",
    "ClosedLoop",
    "Replacements",
    "RobotKnowledge",
    "TransportStation",
    "build_closed_loop",
    "build_robot_controller",
    "build_station",
]
