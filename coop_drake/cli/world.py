"""The command world: simulates a team whose robots and supervisor are processes of their own."""

from __future__ import annotations

from functools import partial

from coop_drake.cli.live import live_page
from coop_drake.cli.node_options import (
    ADDRESSES,
    Addresses,
    OwnKey,
    PlanFile,
    faults_of,
    place_of,
    problem_of,
)
from coop_drake.cli.options import (
    FaultsFile,
    FreeRunning,
    FreshMaps,
    GainsName,
    Live,
    Machine,
    NoFigures,
    Quiet,
    Rejoin,
    ResultsFolder,
    ScenarioPath,
    Verbose,
    Wait,
)
from coop_drake.cli.reporter import reporting
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out
from coop_drake.nodes.states import REJOIN
from coop_drake.viz.drawing_processes import DrawingProcesses


def world_command(
    scenario: ScenarioPath,
    addresses: Addresses = ADDRESSES,
    key: OwnKey = None,
    plan: PlanFile = None,
    out: ResultsFolder = None,
    gains: GainsName = None,
    faults: FaultsFile = None,
    free_running: FreeRunning = False,
    rejoin: Rejoin = REJOIN,
    fresh_maps: FreshMaps = False,
    live: Live = False,
    wait: Wait = False,
    no_figures: NoFigures = False,
    machine: Machine = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate and record a team whose robots and supervisor are processes of their own."""
    with reporting(machine=machine, quiet=quiet, verbose=verbose) as reporter:
        from coop_drake.messages import WORLD
        from coop_drake.nodes import simulate_world, wall_clock

        task, found = problem_of(scenario, gains, plan, reporter)
        folder = ResultFolder.of(task.name, out, "simulation")
        book, keys = place_of(task, addresses, key, WORLD)
        reporter.say("The world waits for the supervisor and all robots")
        with (
            DrawingProcesses(figures=not no_figures) as drawing,
            live_page(task, found, reporter, live=live, wait=wait) as page,
        ):
            world = partial(
                simulate_world,
                book=book,
                keys=keys,
                pacing=wall_clock(task.scenario) if free_running else None,
                rejoin=rejoin,
                faults=faults_of(task, faults),
                report=reporter.facts.update,
                tell=reporter.say,
            )
            reporter.code = carry_out(
                task, found, folder, reporter, drawing, page, world, fresh_maps=fresh_maps
            )
