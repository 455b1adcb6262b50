"""The results that the report is made from: runs with every gain set, the paper's cells, and Figure 3."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import PlanningProblem
from coop_drake.errors import ScenarioError
from coop_drake.harmonic_maps import MapStore
from coop_drake.laws import FixedGains
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.plant.team import ObjectInertia
from coop_drake.scenario import Scenario, with_gains
from paper.approximation import Approximation, approximations, two_components
from paper.comparison import GainFigures, compare_gains
from paper.runs import Progress, Run, part_of, reproduce_runs
from paper.stated import FIGURE_3_SLICES

__all__ = ["Material", "gather"]


@dataclass(frozen=True)
class Material:
    """The results that the report is made from.

    Attributes:
        problem: The reconstruction's question.
        inertia: Of the object.
        table_2: Gains that the scenario has under the name of Table 2.
        made: Approximations of Figure 3.
        runs: One transport for every gain set.
        played: What every gain set made of the paper's own cells.
    """

    problem: PlanningProblem
    inertia: ObjectInertia
    table_2: FixedGains
    made: tuple[Approximation, ...]
    runs: tuple[Run, ...]
    played: tuple[GainFigures, ...]


def gather(
    scenario: Scenario, *, store: MapStore | None = None, progress: Progress | None = None
) -> Material:
    """Plan and simulate what the report compares, with a team that rests in every cell as the paper's does.

    Args:
        scenario: The reconstruction: two robots with a joint each, and the gain sets that are compared.
        store: Where solved maps are kept; by default all are solved.
        progress: Told the stage and the fraction done, if given.

    Raises:
        ScenarioError: The team is another, or Table 2's gains are no fixed ones.
        PlanError: There is no plan.
    """
    table_2 = scenario.gain_sets["table_2"]
    if not isinstance(table_2, FixedGains):
        raise ScenarioError(str(scenario.path), "gains.sets.table_2", type(table_2).__name__, "!FixedGains")
    scenario = with_gains(scenario, scenario.selected_gains)
    team = build_team_plant(scenario, DiagramBuilder())
    problem = planning_problem(scenario, team)
    played = compare_gains(scenario, progress=part_of(progress, 0, 2))  # First, for it refuses other teams.
    runs = reproduce_runs(scenario, problem, store=store, progress=part_of(progress, 1, 2))
    return Material(
        problem=problem,
        inertia=team.object_inertia,
        table_2=table_2,
        made=approximations(two_components(problem.tree), FIGURE_3_SLICES),
        runs=runs,
        played=tuple(played),
    )
