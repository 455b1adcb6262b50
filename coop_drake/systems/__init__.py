"""Thin LeafSystems over the control laws, the velocity fields and the cell planner."""

from coop_drake.systems.arrival_monitor import ArrivalMonitor
from coop_drake.systems.axis_laws import AxisLaw, axis_laws
from coop_drake.systems.axis_ppc import AxisPpc
from coop_drake.systems.block import Block
from coop_drake.systems.cell_planner import CellPlanner
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE
from coop_drake.systems.departure_monitor import DepartureMonitor, MonitoredRobot
from coop_drake.systems.disturbance_observer import DisturbanceObserver
from coop_drake.systems.floor_friction import FloorFriction
from coop_drake.systems.funnel_clock import CLOCK_SIZE, FunnelClock
from coop_drake.systems.hold_monitor import REQUEST_SIZE, HoldMonitor
from coop_drake.systems.hold_receiver import HoldReceiver
from coop_drake.systems.hold_supervisor import HoldSupervisor
from coop_drake.systems.interruption import Interruption
from coop_drake.systems.lagging_effort import LaggingEffort
from coop_drake.systems.limited_effort import LimitedEffort
from coop_drake.systems.lossy_measurement import LossyMeasurement
from coop_drake.systems.measurement_noise import MeasurementNoise
from coop_drake.systems.message_channel import MessageChannel, clear_channel
from coop_drake.systems.nominal_axes import AxisMotion, NominalAxes
from coop_drake.systems.nominal_governor import NominalGovernor, NominalMotion
from coop_drake.systems.object_estimator import ObjectEstimator
from coop_drake.systems.ready_monitor import ReadyMonitor
from coop_drake.systems.reference_governor import GovernedCell, ReferenceGovernor
from coop_drake.systems.robot_effort import RobotEffort
from coop_drake.systems.selector import build_selector
from coop_drake.systems.sensors import TeamSensor, build_separate_sensor
from coop_drake.systems.shifted_measurement import ShiftedMeasurement
from coop_drake.systems.state_predictor import StatePredictor
from coop_drake.systems.sticking import Sticking
from coop_drake.systems.team_link import Exchange, TeamLink, robot_record, supervisor_record
from coop_drake.systems.wheel_slips import WheelSlips
from coop_drake.systems.wrench_law import WrenchLaw

__all__ = [
    "CLOCK_SIZE",
    "CURRENT_CELL_SIZE",
    "READY_SIZE",
    "REQUEST_SIZE",
    "ArrivalMonitor",
    "AxisLaw",
    "AxisMotion",
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
    "NominalAxes",
    "NominalGovernor",
    "NominalMotion",
    "ObjectEstimator",
    "ReadyMonitor",
    "ReferenceGovernor",
    "RobotEffort",
    "ShiftedMeasurement",
    "StatePredictor",
    "Sticking",
    "TeamLink",
    "TeamSensor",
    "WheelSlips",
    "WrenchLaw",
    "axis_laws",
    "build_selector",
    "build_separate_sensor",
    "clear_channel",
    "robot_record",
    "supervisor_record",
]
