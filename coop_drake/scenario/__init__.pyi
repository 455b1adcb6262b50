from .assembly import Assembly, RobotAssembly, assemble
from .control import Control, Hold
from .deployment import (
    ActuatorLimits,
    Deafness,
    Deployment,
    Floor,
    Measurements,
    Messages,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
    StartOffset,
)
from .gain_file import dump_gains, with_gains
from .load import dump_scenario, load_scenario
from .model import (
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
from .packages import package_map
from .waves import Wave, Waves

__all__ = [
    "ActuatorLimits",
    "Assembly",
    "Control",
    "Deafness",
    "Deployment",
    "Floor",
    "Gains",
    "Goal",
    "Hold",
    "MapSettings",
    "Measurements",
    "Messages",
    "ObjectPose",
    "PlantSettings",
    "PoseBias",
    "Push",
    "RobotAssembly",
    "RobotDepartures",
    "Scenario",
    "Silence",
    "SimulatorSettings",
    "Start",
    "StartOffset",
    "Tolerances",
    "VisualizationSettings",
    "Wave",
    "Waves",
    "Workspace",
    "assemble",
    "dump_gains",
    "dump_scenario",
    "load_scenario",
    "package_map",
    "with_gains",
]
