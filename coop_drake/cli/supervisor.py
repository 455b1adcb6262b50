"""The command supervisor: what switches the cells of a team and holds it, as a process of its own."""

from __future__ import annotations

from coop_drake.cli.node_options import (
    ADDRESSES,
    Addresses,
    OwnKey,
    PlanFile,
    faults_of,
    place_of,
    problem_of,
)
from coop_drake.cli.options import FaultsFile, GainsName, Machine, Quiet, ScenarioPath
from coop_drake.cli.reporter import ExitCode, reporting


def supervisor_command(
    scenario: ScenarioPath,
    addresses: Addresses = ADDRESSES,
    key: OwnKey = None,
    plan: PlanFile = None,
    gains: GainsName = None,
    faults: FaultsFile = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Be the supervisor of a team, until the world says that the run is over."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.messages import SUPERVISOR
        from coop_drake.nodes import run_supervisor

        task, found = problem_of(scenario, gains, plan, reporter)
        book, keys = place_of(task, addresses, key, SUPERVISOR)
        reporter.say("The supervisor looks for the world and waits for all robots")
        outcome = run_supervisor(task.scenario, found, book, keys=keys, faults=faults_of(task, faults))
        reporter.facts.update(outcome=outcome)
        reporter.code = ExitCode.DONE if outcome == 0 else ExitCode.FAILED_RUN
