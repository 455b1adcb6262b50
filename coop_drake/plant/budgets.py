"""The budget that a plan shall hold under: the one that is asked for, or the one that a scenario requires."""

from __future__ import annotations

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.budget import Budget
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.disagreement import largest_disagreement
from coop_drake.plant.run_masses import bodies_of_team, joint_inertias, moved_masses
from coop_drake.plant.team import build_team_plant
from coop_drake.scenario import Scenario
from coop_drake.scenario.budget_file import TeamMasses, read_budget


def budget_of(choice: str | None, scenario: Scenario, problem: PlanningProblem) -> Budget | None:
    """Return the budget of a plan, None where none is asked for.

    Args:
        choice: What ``plan --budget`` says; None for what the scenario requires in ``deployment.budget``.
        scenario: The scenario.
        problem: Its planning problem.

    Raises:
        ScenarioError: The budget cannot be read, or no budget can be shown for the scenario's gains.
    """
    required = scenario.deployment.budget
    if choice is None and required == "none":
        return None
    name = scenario.selected_gains
    if not isinstance(scenario.gain_sets[name], ScheduledGains):
        allowed = "a gain set of scheduled gains: the funnels of others never close, so that no budget holds"
        raise ScenarioError(str(scenario.path), "gains.selected", name, allowed)
    return read_budget(choice or required, scenario, problem.tree, lambda: _of_models(scenario))


def _of_models(scenario: Scenario) -> TeamMasses:
    team = build_team_plant(scenario, DiagramBuilder())
    bodies, rotors = bodies_of_team(team, read_component_tree(team)), tuple(joint_inertias(team).tolist())
    return TeamMasses(moved_masses(scenario, team), bodies, rotors, largest_disagreement(scenario, team))
