"""Wiring: one robot's controller, the transport station, the closed loop."""

from coop_drake.diagram.closed_loop import (
    ClosedLoop,
    Loop,
    TransportStation,
    World,
    brakes_of,
    build_closed_loop,
    build_station,
    build_world,
    control_period,
)
from coop_drake.diagram.deployment import TELEMETRY
from coop_drake.diagram.robot_controller import Replacements, RobotKnowledge, build_robot_controller

__all__ = [
    "TELEMETRY",
    "ClosedLoop",
    "Loop",
    "Replacements",
    "RobotKnowledge",
    "TransportStation",
    "World",
    "brakes_of",
    "build_closed_loop",
    "build_robot_controller",
    "build_station",
    "build_world",
    "control_period",
]
