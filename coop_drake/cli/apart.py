"""The commands below apart: the processes of a team whose robots run apart, and their keys."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from coop_drake.apart import REJOIN
from coop_drake.cli.options import (
    FaultsFile,
    FreeRunning,
    GainsName,
    Rejoin,
    ResultsFolder,
    RunOptions,
    ScenarioPath,
    TableOptions,
    command,
    out_folder,
)
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out, faults_of
from coop_drake.cli.simulate import read_plan
from coop_drake.cli.task import Task, map_cells, read_task
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.answers.log import SimulationLog
    from coop_drake.apart.transport import Network
    from coop_drake.scenario import Scenario

EXAMPLES = (
    ("apart keys --robots 2 --out keys", "for processes on this machine that prove who they are"),
    ("apart keys --robots 3 --world 192.168.1.10 --supervisor 192.168.1.11", "for several machines"),
    ("apart supervisor real.scenario.yaml --addresses keys/addresses.yaml", "be the supervisor"),
    ("apart robot real.scenario.yaml 1", "be the second robot"),
    (
        "apart world real.scenario.yaml",
        "with a control rate in it: wait for supervisor and robots, simulate, record",
    ),
)

_FIRST_PORT = 5600
"""Port on which the world's first channel listens where none is named."""

_ADDRESSES = Path("keys") / "addresses.yaml"
"""Where ``apart keys`` writes the address book."""

apart_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Run world, supervisor and robots as processes of their own, on one machine or on several.",
)
"""The command with those below it."""


@dataclass(frozen=True)
class NodeOptions:
    """Options of the processes of a team: what all of them must have in common, and the key of each."""

    addresses: Annotated[
        Path,
        typer.Option("--addresses", metavar="FILE", help="Address book, the same for all; see `apart keys`."),
    ] = _ADDRESSES
    key: Annotated[
        Path | None,
        typer.Option(
            "--key",
            metavar="FILE",
            help="This process' private key; that beside the address book by default.",
        ),
    ] = None
    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan",
            metavar="FILE",
            help="The plan, the same for all; plan.json in the scenario's results by default.",
        ),
    ] = None
    gains: GainsName = None
    faults: FaultsFile = None


@apart_app.command("keys")
@command
def keys_command(
    reporter: Reporter,
    robots: Annotated[int, typer.Option("--robots", metavar="N", help="Number of robots.")] = 2,
    world: Annotated[
        str, typer.Option("--world", metavar="A.B.C.D", help="Address of the machine with the world.")
    ] = "127.0.0.1",
    supervisor: Annotated[
        str | None,
        typer.Option(
            "--supervisor",
            metavar="A.B.C.D",
            help="Address of the machine with the supervisor; that of the world by default.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="P", help="First of the ports that processes listen on.")
    ] = _FIRST_PORT,
    out: Annotated[Path, out_folder("A new folder for the files.")] = Path("keys"),
) -> None:
    """Write an address book with public keys, and a private key for each process, for its owner alone."""
    from coop_drake.apart.team_files import make_team_files
    from coop_drake.errors import ScenarioError
    from coop_drake.typed_data import DataError

    try:
        files = make_team_files(out, robots, (world, supervisor or world), port)
    except DataError as error:
        raise ScenarioError("the options", error.key, error.value, error.allowed) from error
    reporter.facts.update(files=[str(path) for path in files])
    reporter.say(f"Written: {', '.join(escape(str(path)) for path in files)}")
    reporter.say(f"Next: copy {escape(files[0].name)} to every machine, and each .key to that of its process")


@apart_app.command("supervisor")
@command
def supervisor_command(reporter: Reporter, scenario: ScenarioPath, node: NodeOptions) -> None:
    """Be the supervisor of a team, until the world says that the run is over."""
    from coop_drake.apart import run_node
    from coop_drake.apart.messages import SUPERVISOR

    task, found = _problem_of(scenario, node, reporter)
    network = _network_of(task, found, node, SUPERVISOR)
    reporter.say("The supervisor looks for the world and waits for all robots")
    outcome = run_node(task.scenario, found, (), SUPERVISOR, network)
    reporter.facts.update(outcome=outcome)
    reporter.code = ExitCode.DONE if outcome == 0 else ExitCode.FAILED_RUN


@apart_app.command("robot")
@command
def robot_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    robot: Annotated[int, typer.Argument(metavar="K", min=0, help="Which robot, counted from 0.")],
    node: NodeOptions,
) -> None:
    """Be one robot of a team, until the world says that the run is over."""
    from coop_drake.apart import robots_of, run_node

    task, found = _problem_of(scenario, node, reporter)
    robots = robots_of(task.scenario)
    if robot >= robots:
        raise typer.BadParameter(f"K = {robot}: the team has robots 0 to {robots - 1}.")
    network = _network_of(task, found, node, robot)
    maps = map_cells(task, found, reporter)
    reporter.say(f"Robot {robot} looks for the world and the supervisor")
    outcome = run_node(task.scenario, found, maps, robot, network)
    reporter.facts.update(robot=robot, outcome=outcome)
    reporter.code = ExitCode.DONE if outcome == 0 else ExitCode.FAILED_RUN


@apart_app.command("world")
@partial(command, output=TableOptions)
def world_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    out: ResultsFolder = None,
    free_running: FreeRunning = False,
    rejoin: Rejoin = REJOIN,
    *,
    node: NodeOptions,
    options: RunOptions,
) -> None:
    """Simulate and record a team whose robots and supervisor are processes of their own."""
    from coop_drake.apart import run_world, wall_clock
    from coop_drake.apart.messages import WORLD

    task, found = _problem_of(scenario, node, reporter)
    folder = ResultFolder.of(task.name, out, "simulation")
    network = _network_of(task, found, node, WORLD)
    pacing = wall_clock(task.scenario) if free_running else None
    reporter.say("The world waits for the supervisor and all robots")

    def world(scenario: Scenario, plan: Plan, maps: Any, **options: Any) -> SimulationLog:
        options |= {"report": reporter.facts.update, "tell": reporter.say, "pacing": pacing}
        return run_world(scenario, plan, network, rejoin=rejoin, **options)

    with DrawingProcesses(figures=not options.no_figures) as drawing:
        reporter.code = carry_out(task, found, folder, reporter, drawing, world, options)


def _problem_of(scenario: Path, node: NodeOptions, reporter: Reporter) -> tuple[Task, Plan]:
    """Read scenario and plan.

    Raises:
        ScenarioError: The scenario is wrong, or its robots do not compute at common samples.
        PlanError: The file is no plan, or belongs to another scenario.
    """
    from coop_drake.diagram import control_period

    task = read_task(scenario, node.gains, reporter)
    control_period(task.scenario)
    return task, read_plan(task, node.plan or ResultFolder.of(task.name, None).plan, reporter)


def _network_of(task: Task, plan: Plan, node: NodeOptions, index: int) -> Network:
    """Read the address book, the private key of a process by its index in messages, and faults.

    Raises:
        ScenarioError: A file is wrong, or is for another number of robots.
    """
    from coop_drake.apart import network_of, robots_of
    from coop_drake.apart.team_files import key_file, load_address_book, load_own_keys

    book = load_address_book(node.addresses, robots_of(task.scenario))
    beside = node.addresses.parent / key_file(index)
    keys = load_own_keys(book, index, node.key or (beside if beside.exists() else None))
    return network_of(task.scenario, plan, book, keys, faults_of(task, node.faults))
