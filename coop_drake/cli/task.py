"""What most commands begin with: a scenario, read and checked, and the planning problem that it states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from coop_drake.answers import PlanningProblem
    from coop_drake.cli.reporter import Reporter
    from coop_drake.scenario import Scenario


@dataclass(frozen=True)
class Task:
    """A scenario without mistakes.

    Attributes:
        scenario: As in the file, with the chosen gain set selected.
        problem: Floor, bodies, start and goal, as the planner needs them.
    """

    scenario: Scenario
    problem: PlanningProblem

    @property
    def name(self) -> str:
        """The scenario's name."""
        return self.scenario.name


def read_task(path: Path, gains: str | None = None, reporter: Reporter | None = None) -> Task:
    """Read a scenario and its models.

    Args:
        path: The file of the scenario.
        gains: As in `coop_drake.scenario.with_gains`.
        reporter: Shows what the reader of the floor plan left out or assumed, and joints whose kind and
            limits differ; None for nobody.

    Raises:
        ScenarioError: The file, a model or the gain set is wrong.
        FloorPlanError: The floor plan cannot be read.
    """
    from coop_drake.plant import joint_notes, planning_problem
    from coop_drake.scenario import load_scenario
    from coop_drake.scenario.gain_file import with_gains

    scenario = with_gains(load_scenario(path), gains)
    if reporter is not None:
        reporter.note(scenario.workspace.notes)
    problem = planning_problem(scenario)
    if reporter is not None:
        reporter.note(joint_notes(scenario, problem))
    return Task(scenario, problem)
