"""The typed scenario file: dataclasses, loading and validation."""

from coop_drake.scenario.assembly import Assembly, RobotAssembly, assemble
from coop_drake.scenario.deployment import ActuatorLimits, Deployment, Measurements, Messages
from coop_drake.scenario.gain_file import dump_gains, with_gains
from coop_drake.scenario.load import dump_scenario, load_scenario
from coop_drake.scenario.model import (
    Gains,
    Goal,
    MapSettings,
    ObjectPose,
    PlantSettings,
    Scenario,
    SimulatorSettings,
    Start,
    Tolerances,
    VisualizationSettings,
    Workspace,
)
from coop_drake.scenario.packages import package_map

__all__ = [
    "ActuatorLimits",
    "Assembly",
    "Deployment",
    "Gains",
    "Goal",
    "MapSettings",
    "Measurements",
    "Messages",
    "ObjectPose",
    "PlantSettings",
    "RobotAssembly",
    "Scenario",
    "SimulatorSettings",
    "Start",
    "Tolerances",
    "VisualizationSettings",
    "Workspace",
    "assemble",
    "dump_gains",
    "dump_scenario",
    "load_scenario",
    "package_map",
    "with_gains",
]
