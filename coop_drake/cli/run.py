"""The command run, and what carries a plan out: maps, simulation, figures and recording."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import typer
from rich.markup import escape

from coop_drake.cli.options import (
    ApartOptions,
    Effort,
    GainsName,
    ResultsFolder,
    RunOptions,
    ScenarioPath,
)
from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import (
    beyond_budget,
    beyond_limits,
    budget_facts,
    process_lines,
    simulation_facts,
    summary_rows,
)
from coop_drake.cli.task import Task, map_cells, read_task, write_accuracies
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.answers.log import SimulationLog
    from coop_drake.apart.faults import Faults
    from coop_drake.harmonic_maps import HarmonicMap
    from coop_drake.viz import LivePage

Simulation: TypeAlias = "Callable[..., SimulationLog]"
"""Simulates a scenario, plan and maps, and is given ``progress`` and ``observer``."""

_WAIT_FOR_VIEWER = 30.0
"""How long a live run waits for somebody to open its address [s]; a person needs a few seconds."""

EXAMPLES = (
    ("run models/base.scenario.yaml", "plan, simulate and record into out/base/"),
    (
        "run models/base.scenario.yaml --gains table_2 --out out/paper",
        "with the paper's gains, into another folder",
    ),
    ("run models/base.scenario.yaml --live", "watch it in a browser while it is simulated"),
    ("run models/base.scenario.yaml --json --quiet", "one JSON object for machines"),
)


def run_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    out: ResultsFolder = None,
    gains: GainsName = None,
    effort: Effort = None,
    *,
    options: RunOptions,
    apart: ApartOptions,
) -> None:
    """Plan, map, simulate and record a transport."""
    task = read_task(scenario, gains, reporter)
    simulation = simulation_of(task, reporter, apart)
    folder = ResultFolder.of(task.name, out, "plan", "simulation")
    with DrawingProcesses(figures=not options.no_figures) as drawing:
        if plan := plan_of(task, folder, reporter, effort=effort):
            reporter.code = carry_out(task, plan, folder, reporter, drawing, simulation, options)


def simulation_of(task: Task, reporter: Reporter, options: ApartOptions) -> Simulation:
    """Return what simulates: all in one process, or every robot in a process of its own.

    Raises:
        ScenarioError: Robots in processes of their own do not compute at common samples.
    """
    if options.free_running and not options.apart:
        raise typer.BadParameter("--free-running needs --apart: it paces processes of their own.")
    if options.faults and not options.apart:
        raise typer.BadParameter("--faults needs --apart: they are those of messages between processes.")
    if not options.apart:
        return _in_one_process
    from coop_drake.apart import simulate_in_processes, wall_clock
    from coop_drake.diagram import control_period

    control_period(task.scenario)
    return partial(
        simulate_in_processes,
        restarts=options.restarts,
        rejoin=options.rejoin,
        faults=faults_of(task, options.faults),
        pacing=wall_clock(task.scenario) if options.free_running else None,
        report=reporter.facts.update,
        tell=reporter.say,
    )


def _in_one_process(*problem: Any, **options: Any) -> SimulationLog:
    from coop_drake.simulation import simulate

    return simulate(*problem, **options)


def carry_out(
    task: Task,
    plan: Plan,
    folder: ResultFolder,
    reporter: Reporter,
    drawing: DrawingProcesses,
    simulation: Simulation,
    options: RunOptions,
) -> ExitCode:
    """Simulate a plan and record it; a violated invariant or a goal not reached is a failed run.

    Log, accuracies of maps, recording and figures go to the folder; the page of a live view shows the run,
    then the recording.
    """
    with _live_page(task, plan, reporter, options) as page:
        drawing.begin(task.scenario, task.problem, plan)
        maps = map_cells(task, plan, reporter, fresh=options.fresh_maps)
        log = _simulate(task, plan, maps, reporter, simulation, page)
        if page:
            page.show_verdict(log)
        _record(task, maps, log, folder, reporter, drawing, page)
    if log.violation:
        reporter.complain(log.violation)
    elif not log.reached:
        reporter.complain(f"the goal was not reached within {log.times[-1]:.1f} s of simulated time")
    if exceeded := beyond_budget(reporter.facts):
        reporter.complain(exceeded)
    return ExitCode.DONE if reporter.facts["outcome"] == "arrived" else ExitCode.FAILED_RUN


def _record(
    task: Task,
    maps: tuple[HarmonicMap, ...],
    log: SimulationLog,
    folder: ResultFolder,
    reporter: Reporter,
    drawing: DrawingProcesses,
    page: LivePage | None,
) -> None:
    """Write log, accuracies, recording and figures of a run, and show its closing table."""
    folder.begin("simulation", robots=log.robot_names)
    drawing.draw(log, folder.path)
    write_accuracies(task, maps, folder)
    log.save(folder.path / "log.npz")
    with reporter.stage("recording", "drawing"):
        drawing.wait("recording")
    reporter.table(task.name, summary_rows(reporter.facts, verbose=reporter.verbose))
    _warn_of_limits(reporter)
    for line in process_lines(reporter.facts):
        reporter.say(line)
    reporter.say(f"The recording is {escape(str(folder.recording))}; open it in a browser")
    if page:
        page.hand_over(folder.recording)
    with reporter.stage("figures", "drawing"):
        drawing.wait("figures")
    reporter.say(f"All results are in {escape(str(folder.path))}")


def _warn_of_limits(reporter: Reporter) -> None:
    """Say which limits were exceeded, and of which bases and joints no limit of speed is known.

    Nobody may care how fast bases turn.
    """
    speeds = reporter.facts["peak_speeds"]
    if exceeded := beyond_limits(reporter.facts):
        reporter.say(f"[yellow]{escape(exceeded)}[/]")
    unknown = [s["name"] for s in speeds if s["limit"] is None and not s["name"].startswith("turn rate")]
    if unknown:
        names = escape(", ".join(unknown))
        reporter.say(f"[yellow]No limit is known for the {names}; `limits` in the scenario states one[/]")


def _simulate(
    task: Task,
    plan: Plan,
    maps: tuple[HarmonicMap, ...],
    reporter: Reporter,
    simulation: Simulation,
    observer: Callable[..., None] | None,
) -> SimulationLog:
    """Run the closed loop and note the facts."""
    from coop_drake.memory import peak_memory_mb

    with reporter.stage("simulating", "simulation") as progress:
        log = simulation(task.scenario, plan, maps, progress=progress, observer=observer)
    reporter.facts.update(simulation_facts(plan, log, task.problem), peak_memory_mb=peak_memory_mb())
    # Where drives braked, nominal motions began anew.
    braked = min((stop["since"] for stop in reporter.facts.get("stops", ())), default=inf)
    reporter.facts.update(budget_facts(plan, log, braked))
    if reporter.facts["outcome"] == "arrived" and beyond_budget(reporter.facts):
        reporter.facts["outcome"] = "arrived, beyond its budget"
    return log


def faults_of(task: Task, path: Path | None) -> Faults:
    """Read what goes wrong between the processes of a team, nothing without a file.

    Raises:
        ScenarioError: The file is wrong, or is about a robot that the team does not have.
    """
    from coop_drake.apart import robots_of
    from coop_drake.apart.faults import NO_FAULTS, load_faults

    return NO_FAULTS if path is None else load_faults(path, robots_of(task.scenario))


@contextmanager
def _live_page(task: Task, plan: Plan, reporter: Reporter, options: RunOptions) -> Iterator[LivePage | None]:
    """Serve the page of a live view within a ``with`` block, from when a browser shows it; None if not asked.

    On a terminal the run waits half a minute for a browser, with ``--wait`` everywhere until there is one.
    """
    if not (options.live or options.wait):
        yield None
        return
    from coop_drake.viz import LivePage
    from coop_drake.viz.recording import silent_meshcat

    with LivePage(task.scenario, plan, silent_meshcat(), facts=lambda: reporter.facts) as page:
        reporter.facts["live_url"] = page.url
        reporter.say(f"[bold]Live view: open {page.url} in a browser[/]")
        if options.wait or sys.stdout.isatty():
            with reporter.stage("waiting for a browser"):
                page.wait_for_viewer(inf if options.wait else _WAIT_FOR_VIEWER)
        yield page
