"""The budget that a plan shall hold under: the one that is asked for, or the one that a scenario requires."""

from __future__ import annotations

from functools import partial

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.run_masses import base_frames, joint_inertias, largest_disagreement, moved_bodies
from coop_drake.plant.team import build_team_plant
from coop_drake.scenario import Scenario
from coop_drake.scenario.budget_file import ALL, POSITION, TeamMasses, read_budget
from coop_drake.verification.budgets import Facts, OwnBudgets, ScenarioBudgets, wrong_facts


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
    choice, masses = choice or required, _of_models(scenario)
    budget = read_budget(choice, scenario, problem.tree, masses)
    if wrong := wrong_facts(budget, _facts(scenario, masses)):
        raise ScenarioError(choice, wrong[0], getattr(budget, wrong[0]), wrong[1])
    if budget.limited and masses.springs:
        allowed = "none where an effort is limited: no budget bounds what springs in the models take"
        raise ScenarioError(str(scenario.path), "directives", "springs", allowed)
    return budget


def scenario_budgets(scenario: Scenario, problem: PlanningProblem) -> ScenarioBudgets:
    """Return what a scenario says about budgets, with which ``verify`` compares that of a plan."""
    return ScenarioBudgets(scenario.deployment.budget, partial(_own_budgets, scenario, problem))


def _own_budgets(scenario: Scenario, problem: PlanningProblem) -> OwnBudgets:
    """Return the budgets of a scenario's deployment, and the masses that belong into every budget.

    Raises:
        ScenarioError: The scenario requires a budget, but has departures that none counts.
    """
    masses, own, missing = _of_models(scenario), dict[str, Budget](), ""
    for choice in (ALL, POSITION):
        try:
            own[choice] = read_budget(choice, scenario, problem.tree, masses)
        except ScenarioError as error:
            if scenario.deployment.budget == choice:
                raise
            missing = missing or f"{error.key} is {error.shown}"
    return OwnBudgets(own, missing, _facts(scenario, masses))


def _facts(scenario: Scenario, masses: TeamMasses) -> Facts:
    """Return what no budget of a scenario may state otherwise."""
    limits = {name: getattr(scenario.deployment.actuators, name) for name in LIMITS}
    return Facts(masses.bodies, masses.bases, masses.rotors, masses.dampings, limits)


def _of_models(scenario: Scenario) -> TeamMasses:
    team = build_team_plant(scenario, DiagramBuilder())
    context = team.plant.CreateDefaultContext()
    return TeamMasses(
        bodies=moved_bodies(scenario, team),
        bases=base_frames(team, read_component_tree(team)),
        rotors=tuple(joint_inertias(team).tolist()),
        dampings=tuple(float(joint.GetDampingVector(context)[0]) for joint in team.joints),
        disagreement=largest_disagreement(scenario, team),
        springs=team.plant.num_force_elements() > 1,  # every plant has gravity
    )
