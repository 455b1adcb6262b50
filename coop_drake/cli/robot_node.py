"""The command robot-node: one robot of a team as a process of its own."""

from __future__ import annotations

from typing import Annotated

import typer

from coop_drake.cli.maps import map_cells
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


def robot_node_command(
    scenario: ScenarioPath,
    robot: Annotated[int, typer.Argument(metavar="K", min=0, help="Which robot, counted from 0.")],
    addresses: Addresses = ADDRESSES,
    key: OwnKey = None,
    plan: PlanFile = None,
    gains: GainsName = None,
    faults: FaultsFile = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Be one robot of a team, until the world says that the run is over."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.nodes import robots_of, run_robot

        task, found = problem_of(scenario, gains, plan, reporter)
        robots = robots_of(task.scenario)
        if robot >= robots:
            raise typer.BadParameter(f"K = {robot}: the team has robots 0 to {robots - 1}.")
        book, keys = place_of(task, addresses, key, robot)
        maps = map_cells(task, found, reporter)
        reporter.say(f"Robot {robot} looks for the world and the supervisor")
        outcome = run_robot(
            task.scenario, found, maps, robot, book, keys=keys, faults=faults_of(task, faults)
        )
        reporter.facts.update(robot=robot, outcome=outcome)
        reporter.code = ExitCode.DONE if outcome == 0 else ExitCode.FAILED_RUN
