"""Checks of whole runs by their logs."""

from __future__ import annotations

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario import Scenario
from coop_drake.verification.checks import Verified
from coop_drake.verification.runs import verify_log


def verified_run(scenario: Scenario, plan: Plan, log: SimulationLog) -> Verified:
    """What the checker of logs says of a run; it raises a RefusalError where a statement does not hold."""
    return verify_log(log, plan, planning_problem(scenario), run_setup(scenario))
