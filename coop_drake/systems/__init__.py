"""Thin LeafSystems over the control laws, the velocity fields and the cell planner."""

from coop_drake.systems.axis_laws import AxisLaw, axis_laws
from coop_drake.systems.block import Block
from coop_drake.systems.cell_planner import CellPlanner
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE
from coop_drake.systems.free_robot_sensor import FreeRobotSensor
from coop_drake.systems.joint_ppc import JointPpc
from coop_drake.systems.message_channel import MessageChannel, whole_periods
from coop_drake.systems.object_estimator import ObjectEstimator
from coop_drake.systems.orientation_ppc import OrientationPpc
from coop_drake.systems.ready_monitor import ReadyMonitor
from coop_drake.systems.reference_governor import GovernedCell, ReferenceGovernor
from coop_drake.systems.robot_effort import RobotEffort
from coop_drake.systems.sensors import ObjectPoseSensor, RobotStateSensor
from coop_drake.systems.team_controller import TeamController
from coop_drake.systems.team_kernels import FusedCell, FusedTeam
from coop_drake.systems.wrench_law import WrenchLaw

__all__ = [
    "CURRENT_CELL_SIZE",
    "READY_SIZE",
    "AxisLaw",
    "Block",
    "CellPlanner",
    "FreeRobotSensor",
    "FusedCell",
    "FusedTeam",
    "GovernedCell",
    "JointPpc",
    "MessageChannel",
    "ObjectEstimator",
    "ObjectPoseSensor",
    "OrientationPpc",
    "ReadyMonitor",
    "ReferenceGovernor",
    "RobotEffort",
    "RobotStateSensor",
    "TeamController",
    "WrenchLaw",
    "axis_laws",
    "whole_periods",
]
