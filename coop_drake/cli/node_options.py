"""What the commands world, robot-node and supervisor have in common: addresses, own key, plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.simulate import read_plan
from coop_drake.cli.task import Task, read_task

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.messages import AddressBook, KeyPair
    from coop_drake.messages.faults import Faults

Addresses = Annotated[
    Path,
    typer.Option("--addresses", metavar="FILE", help="Address book, the same for all; see `keys`."),
]
OwnKey = Annotated[
    Path | None,
    typer.Option(
        "--key", metavar="FILE", help="This process' private key; that beside the address book by default."
    ),
]
PlanFile = Annotated[
    Path | None,
    typer.Option(
        "--plan",
        metavar="FILE",
        help="The plan, the same for all; plan.json in the scenario's results by default.",
    ),
]
ADDRESSES = Path("keys") / "addresses.yaml"
"""Where ``keys`` writes the address book."""


def problem_of(scenario: Path, gains: str | None, plan: Path | None, reporter: Reporter) -> tuple[Task, Plan]:
    """Read scenario and plan.

    Raises:
        ScenarioError: The scenario is wrong, or its robots do not compute at common samples.
        PlanError: The file is no plan, or belongs to another scenario.
    """
    from coop_drake.diagram import control_period

    task = read_task(scenario, gains, reporter)
    control_period(task.scenario)
    return task, read_plan(task, plan or ResultFolder.of(task.name, None).plan, reporter)


def place_of(task: Task, addresses: Path, key: Path | None, index: int) -> tuple[AddressBook, KeyPair | None]:
    """Read the address book and the private key of a process, by its index in messages.

    Raises:
        ScenarioError: A file is wrong, or the book is for another number of robots.
    """
    from coop_drake.messages import load_address_book, load_own_keys
    from coop_drake.messages.team_files import key_file
    from coop_drake.nodes import robots_of

    book = load_address_book(addresses, robots_of(task.scenario))
    beside = addresses.parent / key_file(index)
    return book, load_own_keys(book, index, key or (beside if beside.exists() else None))


def faults_of(task: Task, path: Path | None) -> Faults:
    """Read what goes wrong between the processes of a team, nothing without a file.

    Raises:
        ScenarioError: The file is wrong, or is about a robot that the team does not have.
    """
    from coop_drake.messages.faults import NO_FAULTS, load_faults
    from coop_drake.nodes import robots_of

    return NO_FAULTS if path is None else load_faults(path, robots_of(task.scenario))
