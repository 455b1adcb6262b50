"""Thin LeafSystems over the control laws, the velocity fields and the cell planner."""

from coop_drake.systems.actuators import LaggingEffort, LimitedEffort, RobotEffort, WrenchLaw
from coop_drake.systems.block import (
    CLOCK_SIZE,
    CURRENT_CELL_SIZE,
    READY_SIZE,
    REQUEST_SIZE,
    Block,
    build_selector,
    robot_record,
    supervisor_record,
)
from coop_drake.systems.departures import FloorFriction, Pushes, Sticking, WheelSlips
from coop_drake.systems.governor import GovernedCell, ReferenceGovernor
from coop_drake.systems.holds import FunnelClock, HoldMonitor, HoldReceiver, HoldSupervisor
from coop_drake.systems.measurements import (
    DisturbanceObserver,
    LossyMeasurement,
    MeasurementNoise,
    ObjectEstimator,
    ShiftedMeasurement,
    StatePredictor,
    TeamSensor,
    build_separate_sensor,
)
from coop_drake.systems.messages import Exchange, Interruption, MessageChannel, TeamLink
from coop_drake.systems.monitors import ArrivalMonitor, DepartureMonitor, MonitoredRobot
from coop_drake.systems.motion import MotionFollower, PassingMonitor
from coop_drake.systems.ppc import AxisLaw, AxisPpc, axis_laws
from coop_drake.systems.readiness import CellPlanner, ReadyMonitor
from coop_drake.systems.words import Radio, RobotWords, WordPlanner

__all__ = [
    "CLOCK_SIZE",
    "CURRENT_CELL_SIZE",
    "READY_SIZE",
    "REQUEST_SIZE",
    "ArrivalMonitor",
    "AxisLaw",
    "AxisPpc",
    "Block",
    "CellPlanner",
    "DepartureMonitor",
    "DisturbanceObserver",
    "Exchange",
    "FloorFriction",
    "FunnelClock",
    "GovernedCell",
    "HoldMonitor",
    "HoldReceiver",
    "HoldSupervisor",
    "Interruption",
    "LaggingEffort",
    "LimitedEffort",
    "LossyMeasurement",
    "MeasurementNoise",
    "MessageChannel",
    "MonitoredRobot",
    "MotionFollower",
    "ObjectEstimator",
    "PassingMonitor",
    "Pushes",
    "Radio",
    "ReadyMonitor",
    "ReferenceGovernor",
    "RobotEffort",
    "RobotWords",
    "ShiftedMeasurement",
    "StatePredictor",
    "Sticking",
    "TeamLink",
    "TeamSensor",
    "WheelSlips",
    "WordPlanner",
    "WrenchLaw",
    "axis_laws",
    "build_selector",
    "build_separate_sensor",
    "robot_record",
    "supervisor_record",
]
