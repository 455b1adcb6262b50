"""The chain's second half: from a plan through maps and the closed loop to pictures; each notes its facts."""

from __future__ import annotations

from pathlib import Path

from rich.markup import escape

from coop_drake.answers import Found, Plan
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.live import open_live_view
from coop_drake.cli.mapping import map_cells, save_certificates
from coop_drake.cli.measures import simulation_measures
from coop_drake.cli.planning import plan_question, read_plan, without_plan
from coop_drake.cli.reading import Task, read_task
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import summary_rows
from coop_drake.diagram import Blocks
from coop_drake.fields import HarmonicMap
from coop_drake.memory import peak_memory_mb
from coop_drake.simulation import SimulationLog, simulate
from coop_drake.viz import LiveView, write_figures, write_recording

__all__ = ["run_scenario", "simulate_scenario"]


def run_scenario(
    scenario: Path,
    gains: str | None,
    out: Path | None,
    reporter: Reporter,
    *,
    fresh_maps: bool = False,
    live: bool = False,
    blocks: Blocks = "named",
) -> ExitCode:
    """Plan and carry the plan out, with maps solved before unless fresh ones are asked for."""
    task = read_task(scenario, gains)
    folder = ResultFolder.of(task.scenario.name, out)
    result = plan_question(task.question, folder, reporter)
    if not isinstance(result, Found):
        return without_plan(task.question, result, folder, reporter)
    return _carry_out(task, result.plan, folder, reporter, fresh_maps=fresh_maps, live=live, blocks=blocks)


def simulate_scenario(
    scenario: Path,
    gains: str | None,
    plan_file: Path | None,
    out: Path | None,
    reporter: Reporter,
    *,
    fresh_maps: bool = False,
    live: bool = False,
    blocks: Blocks = "named",
) -> ExitCode:
    """Carry out a plan made before: the file that is named, or the one among the scenario's results."""
    task = read_task(scenario, gains)
    folder = ResultFolder.of(task.scenario.name, out)
    found = read_plan(task.question, plan_file or folder.plan, reporter, gains_given=gains is not None)
    return _carry_out(task, found, folder, reporter, fresh_maps=fresh_maps, live=live, blocks=blocks)


def _carry_out(
    task: Task,
    found: Plan,
    folder: ResultFolder,
    reporter: Reporter,
    *,
    fresh_maps: bool,
    live: bool,
    blocks: Blocks,
) -> ExitCode:
    """Simulate a plan and record it; a violated invariant or a goal not reached is a failed run."""
    maps = map_cells(task, found, reporter, fresh=fresh_maps)
    onlooker = open_live_view(task.scenario, found, reporter) if live else None
    log = _simulate(task, found, maps, folder, reporter, blocks, onlooker)
    _draw(task, found, log, folder, reporter)
    reporter.table(task.scenario.name, summary_rows(reporter.facts))
    reporter.say(
        f"Results are in {escape(str(folder.path))}; open {escape(str(folder.recording))} in a browser"
    )
    if log.violation:
        reporter.complain(log.violation)
    elif not log.reached:
        reporter.complain(f"the goal was not reached within {log.times[-1]:.1f} s of simulated time")
    return ExitCode.DONE if log.reached and not log.violation else ExitCode.FAILED_RUN


def _simulate(
    task: Task,
    found: Plan,
    maps: tuple[HarmonicMap, ...],
    folder: ResultFolder,
    reporter: Reporter,
    blocks: Blocks,
    onlooker: LiveView | None,
) -> SimulationLog:
    """Run the closed loop, note how it went, and write the log and the maps' certificates."""
    with reporter.stage("simulating") as progress, reporter.stopwatch("simulation"):
        log = simulate(task.scenario, found, maps, blocks=blocks, progress=progress, onlooker=onlooker)
    reporter.facts.update(simulation_measures(found, log), peak_memory_mb=peak_memory_mb())
    folder.make()
    folder.forget_simulation()
    save_certificates(task, maps, folder)
    log.save(folder.log)
    return log


def _draw(task: Task, found: Plan, log: SimulationLog, folder: ResultFolder, reporter: Reporter) -> None:
    """Draw the figures and write the recording."""
    problem = task.question.problem
    with reporter.stage("drawing"):
        write_figures(problem.workspace, problem.tree, found, log, folder.path)
    with reporter.stage("recording") as progress, reporter.stopwatch("recording"):
        write_recording(task.scenario, found, log, folder.recording, progress=progress)
