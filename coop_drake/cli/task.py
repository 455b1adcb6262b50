"""What most commands begin with: a scenario, read and checked, and the planning problem that it states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from coop_drake.answers import PlanningProblem
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


def read_task(path: Path, gains: str | None = None) -> Task:
    """Read a scenario and its models; ``gains`` as in `coop_drake.scenario.with_gains`.

    Raises:
        ScenarioError: The file, a model or the gain set is wrong.
    """
    from coop_drake.files import cache_folder
    from coop_drake.plant.kept_problem import keep_problem, kept_problem
    from coop_drake.scenario.gain_file import with_gains
    from coop_drake.scenario.load import read_scenario

    read, folder = read_scenario(path), cache_folder("problems")
    problem = kept_problem(read, folder)
    if problem is not None:
        return Task(with_gains(read, gains), problem)
    from coop_drake.plant import planning_problem
    from coop_drake.scenario.validation import validate

    validate(read)
    scenario = with_gains(read, gains)
    problem = planning_problem(scenario)
    keep_problem(scenario, problem, folder)
    return Task(scenario, problem)
