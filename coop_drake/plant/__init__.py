"""Plants made of the scenario's models, and the component tree read from their collision geometry."""

from coop_drake.plant.configuration import base_poses, get_configuration, get_rates, set_configuration
from coop_drake.plant.robot import RobotPlant, build_robot_plant
from coop_drake.plant.team import ObjectInertia, RobotModel, TeamPlant, build_team_plant

__all__ = [
    "ObjectInertia",
    "RobotModel",
    "RobotPlant",
    "TeamPlant",
    "base_poses",
    "build_robot_plant",
    "build_team_plant",
    "get_configuration",
    "get_rates",
    "set_configuration",
]
