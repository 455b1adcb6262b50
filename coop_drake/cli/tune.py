"""The command tune: plan once, search better gains by simulating, verify the best, and write them."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import GainsName, ScenarioPath, out_folder
from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import map_cells, read_task
from coop_drake.files import write_atomically

if TYPE_CHECKING:
    from coop_drake.laws import GainSet
    from coop_drake.tuning import Search, TrialOutcome

_TUNED = "tuned"
"""Name of the gain set that is written, and of the folder it is in."""

_PATIENCE = 2.0
"""A trial is ended when it takes this many times as long as before, or as a limit allows [-]."""

_RESTS = (
    "gains are tuned for a team that rests in every cell, from those of --gains scheduled: a team that "
    "passes from cell to cell, as this scenario's does, has none to tune"
)
"""What is said where the scenario selects no gain set."""

EXAMPLES = (
    ("tune models/base.scenario.yaml", "less force in no more time, into out/base/tuned/gains.yaml"),
    (
        'tune models/base.scenario.yaml --criterion time --limit "peak_force<=1x"',
        "less time with no more force",
    ),
    ("run models/base.scenario.yaml --gains out/base/tuned/gains.yaml", "use them"),
)


def tune_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    criteria: Annotated[
        list[str] | None,
        typer.Option(
            "--criterion",
            "-c",
            metavar="NAME[=WEIGHT]",
            help="What to improve: time, peak_force, force_rate, mean_force, peak_base_torque, "
            "peak_torque, peak_turning, clearance, cell_margin, funnel_margin. Several are weighed; default "
            "peak_force.",
        ),
    ] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            "-l",
            metavar="LIMIT",
            help="What must be kept: time<=16, clearance>=0.1, or time<=1.1x for 1.1 times the value before. "
            "Default: time<=1x (not slower than before).",
        ),
    ] = None,
    gains: GainsName = None,
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="GAIN", help="Gains that may change; all by default."),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", metavar="N", min=1, help="Runs to try.")] = 120,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the search.")] = 0,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes; one a core by default.")
    ] = None,
    out: Annotated[Path | None, out_folder("Where results go; out/<scenario>/tuned by default.")] = None,
) -> None:
    """Choose gains: less force, less time or more room, judged by simulating the whole transport.

    The best gain set is written as gains.yaml, which run, plan and simulate take with --gains. Ctrl-C ends
    the search with the best so far.
    """
    from coop_drake.scenario.model import SCHEDULED
    from coop_drake.tuning import (
        Limit,
        Objective,
        TrialRunner,
        Workers,
        read_weights,
        search,
        tunable_parameters,
    )
    from coop_drake.tuning.search import load_optimizer
    from coop_drake.viz.tuning_figure import write_tuning_figure

    load_optimizer()
    wanted = criteria or ["peak_force"], ["time<=1x"] if limits is None else limits
    weights, kept = read_weights(wanted[0]), tuple(map(Limit.parse, wanted[1]))
    task = read_task(scenario, gains, reporter)
    if task.scenario.passes:
        reporter.note([_RESTS])
        task = read_task(scenario, SCHEDULED)
    start = task.scenario.gain_sets[task.scenario.selected_gains]
    parameters = tunable_parameters(start, vary or ())
    folder = ResultFolder.of(task.name, out, "plan", "tuning", below=_TUNED)
    plan = plan_of(task, folder, reporter)
    if plan is None:
        return
    runner = TrialRunner(task.scenario, plan, map_cells(task, plan, reporter))
    with reporter.stage("before"):
        before = runner.simulate(start)
    objective = Objective(weights, kept, before.outcome.values)
    allowed = [limit.bound(objective.before) for limit in kept if limit.criterion == "time"]
    longest = _PATIENCE * max([objective.before["time"], *allowed])
    count = min(workers or os.cpu_count() or 1, runs)
    with (
        reporter.stage("searching", "search") as progress,
        Workers(task.scenario.path, plan, runner.maps, longest=longest, count=count) as processes,
    ):
        found = search(
            before, parameters, objective, processes.try_all, runs=runs, seed=seed, progress=progress
        )
    if not found.interrupted:
        with reporter.stage("verifying"):
            found.verify(runner.simulate)
    folder.begin("tuning")
    _write_trials(found, folder.path / "trials.json")
    after, tried, anew = found.best.outcome, len(found.trials) - 1, None
    if found.interrupted:  # Drawing and planning anew would take longer than Ctrl-C may.
        state = f"Not verified: interrupted after {tried} trials."
    else:
        write_tuning_figure(found, folder.path / "tuning.png")
        with reporter.stage("planning anew"):
            anew = runner.replan(task.problem, found.best.gains)
        state = "Verified: arrives, keeps all limits."
        if not objective.kept(after):
            state = "Not good: a limit is broken or the run failed."
    remarks = (
        "Gains chosen by coop-drake tune; use them with --gains and this file.",
        f"Better: {', '.join(wanted[0])}; kept: {', '.join(wanted[1]) or 'no limit'}.",
        f"{tried} runs tried, seed {seed}. {state}",
    )
    path = write_gains(found.best.gains, remarks, folder.path / "gains.yaml")
    reporter.facts["gains_file"] = str(path)
    reporter.say(f"The gain set is in {escape(str(path))}; use it with --gains {escape(str(path))}")
    _show(reporter, "Best so far" if found.interrupted else f"{task.name}, gains tuned", found, after, anew)
    if found.interrupted:
        reporter.complain("interrupted; the best so far is written")
        reporter.code = ExitCode.INTERRUPTED
        return
    if found.best is found.trials[0]:
        reporter.say(f"None of {tried} runs was better: these are the gains there were before.")
    if not objective.kept(after):
        reporter.complain(f"no gains were found that keep every limit: {after.violation or tuple(wanted[1])}")
        reporter.code = ExitCode.FAILED_RUN


def write_gains(gains: GainSet, remarks: Sequence[str], path: Path) -> Path:
    """Write a gain set with comments before it, one line each."""
    from coop_drake.scenario import dump_gains

    comments = "".join(f"# {remark}\n" for remark in remarks)
    return write_atomically(path, (comments + dump_gains(_TUNED, gains)).encode())


def _write_trials(found: Search, path: Path) -> Path:
    """Write every trial in the order of the search, the run before tuning first."""
    rows = []
    for trial, score in zip(found.trials, found.scores, strict=True):
        outcome = asdict(trial.outcome)
        outcome["share_done"] = outcome.pop("fraction_done")
        rows.append({"score": score, "loop": trial.loop, **outcome, "gains": asdict(trial.gains)})
    document = {
        "weights": dict(found.objective.weights),
        "limits": [asdict(limit) for limit in found.objective.limits],
        "best": found.trials.index(found.best),
        "trials": rows,
    }
    return write_atomically(path, json.dumps(document, indent=1).encode() + b"\n")


def _show(
    reporter: Reporter, title: str, found: Search, after: TrialOutcome, anew: TrialOutcome | None
) -> None:
    """Show every criterion before and after, and note the values."""
    from coop_drake.tuning import CRITERIA

    before = found.objective.before
    rows = []
    for name, criterion in CRITERIA.items():
        change = 100.0 * (after.values[name] / before[name] - 1.0) if before[name] else 0.0
        wanted = " *" if name in found.objective.weights else ""
        cells = [f"{before[name]:.4g}", f"{after.values[name]:.4g}", f"{change:+.0f} %"]
        cells.append("" if anew is None else f"{anew.values[name]:.4g}" if anew.arrived else "fails")
        rows.append((escape(f"{criterion.label} [{criterion.unit}]{wanted}"), *cells))
    reporter.table(f"{title} (* sought)", rows, ("before", "after", "change", "planned anew"))
    reporter.facts.update(before=dict(before), after=dict(after.values), trials=len(found.trials) - 1)
    reporter.facts["planned_anew"] = None if anew is None else dict(anew.values)
