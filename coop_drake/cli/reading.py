"""Reads a scenario and its models with Drake; as a module of its own, for another process."""

from __future__ import annotations

import os
import pickle
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path

from pydrake.systems.framework import DiagramBuilder

from coop_drake.cli.question import Question
from coop_drake.errors import CoopDrakeError
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario, load_scenario, with_gains

__all__ = ["Task", "main", "read_task"]


@dataclass(frozen=True)
class Task:
    """A scenario that was read and found sound.

    Attributes:
        scenario: As in the file.
        question: What the planner is asked.
    """

    scenario: Scenario
    question: Question


def read_task(path: Path, gains: str | None) -> Task:
    """Read a scenario and its models.

    Args:
        path: The scenario file.
        gains: Name of the gain set to use, or a file that holds one; None for the one the scenario selects.

    Raises:
        ScenarioError: The file, a model or the gain set is wrong.
    """
    scenario = with_gains(load_scenario(path), gains)
    name = scenario.selected_gains
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    return Task(scenario, Question(scenario.name, scenario.path, problem, scenario.gain_sets, name))


def main() -> None:
    """Answer ``read_apart``: a question, or what was raised; all that is printed goes to standard error."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as answer:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        path, gains = pickle.load(sys.stdin.buffer)
        came: Question | Exception
        try:
            came = read_task(path, gains).question
        except Exception as error:
            if not isinstance(error, (CoopDrakeError, OSError)):
                error.add_note(traceback.format_exc())  # A traceback stays behind when its error is sent.
            came = error
        pickle.dump(came, answer)


if __name__ == "__main__":
    main()
