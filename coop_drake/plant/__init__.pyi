from .component_tree import read_component_tree
from .configuration import base_poses, set_configuration
from .planar_chain import BaseChain, base_chain, robot_chain
from .problem import joint_notes, planning_problem
from .robot import RobotPlant, build_robot_plant
from .run_masses import run_setup, turning_coupling
from .separate_team import SeparateTeam, build_separate_team
from .team import ObjectInertia, RobotModel, TeamPlant, build_team_plant
from .team_tree import TeamTree, read_team_tree

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
