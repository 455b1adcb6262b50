"""The scenario files on which planners are compared."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import PlanningProblem
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario, load_scenario

_ROOT = Path(__file__).resolve().parents[2]
_SHIPPED = _ROOT / "models"
_HARDER = _ROOT / "benchmarks" / "scenarios"


@dataclass(frozen=True)
class Case:
    """One scenario file.

    Attributes:
        name: Its name, without endings.
        passable: Whether there is a way.
        folder: Where the file stands.
    """

    name: str
    passable: bool = True
    folder: Path = _SHIPPED

    def scenario(self) -> Scenario:
        """Read the file."""
        return load_scenario(str(self.folder / f"{self.name}.scenario.yaml"))

    def problem(self) -> PlanningProblem:
        """Read the file and its models; what the planner is asked."""
        scenario = self.scenario()
        return planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))


CASES = (
    Case("base"),
    Case("tight"),
    Case("closed", passable=False),
    Case("three"),
    Case("elbow"),
    Case("elbow_narrow", folder=_HARDER),
    Case("three_narrow", folder=_HARDER),
    Case("three_closed", passable=False, folder=_HARDER),
    Case("four", folder=_HARDER),
)
