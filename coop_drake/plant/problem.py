"""Builds the planning problem from a scenario and its plant."""

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.problem import PlanningProblem
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.limits import read_limits
from coop_drake.plant.stated_problem import stated_problem
from coop_drake.plant.team import TeamPlant, build_team_plant
from coop_drake.plant.validation import check_joints, check_places
from coop_drake.scenario import Scenario


def planning_problem(scenario: Scenario, team: TeamPlant | None = None) -> PlanningProblem:
    """Put start, goal, walls and bodies together, and refuse inputs that are certainly mistakes.

    ``team`` is the plant that was built from the scenario; None to build it here.

    Raises:
        ScenarioError: Models that make no team, joints that do not fit the robots or their limits, a start in
            collision, a goal where the object leaves the floor, or bodies whose footprint cannot be read.
    """
    if team is None:
        team = build_team_plant(scenario, DiagramBuilder())
    check_joints(scenario, team)
    joints = {robot.name: len(robot.joints) for robot in team.robots}
    tree = read_component_tree(team)
    problem = stated_problem(scenario, tree, joints, read_limits(team, tree))
    check_places(scenario, problem)
    return problem
