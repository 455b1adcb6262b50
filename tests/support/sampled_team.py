"""The open-room transport of a team that is controlled at samples."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from coop_drake.answers.plan import Plan
from coop_drake.scenario import Control, Deployment, Scenario
from tests.support.small_loop import small_problem


def sampled(team: str, control: Control | None = None, **departures: Any) -> tuple[Scenario, Plan]:
    """Scenario at 100 Hz and hand-written plan of a team, with departures from the ideal one."""
    scenario, plan = small_problem(team)
    deployment = Deployment(control_rate=100.0, **departures)
    return replace(scenario, deployment=deployment, control=control or Control()), plan
