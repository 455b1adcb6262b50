"""The open-room transport as a closed loop, for every team that ships."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.diagram import ClosedLoop, build_closed_loop
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap, VelocityField
from coop_drake.laws import GainSet
from coop_drake.plant import build_team_plant
from coop_drake.scenario import Control, Deployment, Scenario
from coop_drake.simulation import build_maps
from coop_drake.systems import GovernedCell
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario

TEAMS = ("base", "elbow", "three")


@cache
def small_maps() -> tuple[HarmonicMap, ...]:
    """Maps of the plan's cells; they are the same for every team and every gain set."""
    return build_maps(small_plan(()))


def small_problem(team: str = "base", gain_set: GainSet | None = None) -> tuple[Scenario, Plan]:
    """Scenario and hand-written plan of a team."""
    scenario = small_scenario(team)
    return scenario, small_plan(joint_names(scenario), gain_set)


def sampled(team: str, control: Control | None = None, **departures: Any) -> tuple[Scenario, Plan]:
    """Scenario at 100 Hz and hand-written plan of a team, with departures from the ideal one."""
    scenario, plan = small_problem(team)
    deployment = Deployment(control_rate=100.0, **departures)
    return replace(scenario, deployment=deployment, control=control or Control()), plan


def joint_names(scenario: Scenario) -> tuple[str, ...]:
    """Names of a team's joints in the order of q."""
    return build_team_plant(scenario, DiagramBuilder()).joint_names


def small_loop(team: str = "base", gain_set: GainSet | None = None) -> ClosedLoop:
    """The closed loop of a team."""
    scenario, plan = small_problem(team, gain_set)
    return build_closed_loop(scenario, plan, small_maps())


def governed_cells(plan: Plan) -> list[GovernedCell]:
    """Clearance, field and gains of every cell of a hand-written plan."""
    return [
        GovernedCell(BoundaryDistance(cell.tidied), VelocityField(field_map), transition.gains)
        for cell, field_map, transition in zip(plan.cells, small_maps(), plan.transitions, strict=True)
    ]
