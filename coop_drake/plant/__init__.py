"""Plants made of the scenario's models, and the component tree read from their collision geometry."""

from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.configuration import base_poses, get_configuration, get_rates, set_configuration
from coop_drake.plant.planar_chain import BaseChain, base_chain, robot_chain
from coop_drake.plant.problem import planning_problem
from coop_drake.plant.robot import RobotPlant, build_robot_plant
from coop_drake.plant.separate_team import SeparateTeam, build_separate_team
from coop_drake.plant.team import ObjectInertia, RobotModel, TeamPlant, build_team_plant

__all__ = [
    "BaseChain",
    "ObjectInertia",
    "RobotModel",
    "RobotPlant",
    "SeparateTeam",
    "TeamPlant",
    "base_chain",
    "base_poses",
    "build_robot_plant",
    "build_separate_team",
    "build_team_plant",
    "get_configuration",
    "get_rates",
    "planning_problem",
    "read_component_tree",
    "robot_chain",
    "set_configuration",
]
