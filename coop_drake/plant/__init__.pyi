from .component_tree import read_component_tree
from .facts import BaseChain, TeamTree, base_chain, read_team_tree, robot_chain, run_setup, turning_coupling
from .problem import joint_notes, planning_problem
from .separate_team import SeparateTeam, build_separate_team
from .team import (
    ObjectInertia,
    RobotModel,
    RobotPlant,
    TeamPlant,
    base_poses,
    build_robot_plant,
    build_team_plant,
    set_configuration,
)

__all__ = [
    "BaseChain",
    "ObjectInertia",
    "RobotModel",
    "RobotPlant",
    "SeparateTeam",
    "TeamPlant",
    "TeamTree",
    "base_chain",
    "base_poses",
    "build_robot_plant",
    "build_separate_team",
    "build_team_plant",
    "joint_notes",
    "planning_problem",
    "read_component_tree",
    "read_team_tree",
    "robot_chain",
    "run_setup",
    "set_configuration",
    "turning_coupling",
]
