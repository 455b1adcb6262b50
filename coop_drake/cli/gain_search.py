"""What the command tune does: plan once, search better gains by simulating, verify the best, write them."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.markup import escape

from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import Task, map_cells, read_task
from coop_drake.files import write_atomically
from coop_drake.laws import GainSet
from coop_drake.scenario import dump_gains
from coop_drake.tuning import (
    CRITERIA,
    GainTrial,
    Limit,
    Objective,
    Parameter,
    Search,
    TrialOutcome,
    TrialRunner,
    Workers,
    read_weights,
    search,
    tunable_parameters,
)
from coop_drake.tuning.search import load_optimizer
from coop_drake.viz.tuning_figure import write_tuning_figure

_TUNED = "tuned"
"""Name of the gain set that is written, and of the folder it is in."""

_PATIENCE = 2.0
"""A trial is ended when it takes this many times as long as before, or as a limit allows [-]."""


@dataclass(frozen=True)
class Request:
    """What the search is asked for, as typed on the command line.

    Attributes:
        criteria: NAME or NAME=WEIGHT.
        limits: Such as time<=16.
        vary: Names of gains that may change; empty for all.
        runs: Runs to try.
        seed: Seed of the search.
        workers: Processes; None for one a core.
    """

    criteria: tuple[str, ...]
    limits: tuple[str, ...]
    vary: tuple[str, ...]
    runs: int
    seed: int
    workers: int | None


def tune(
    scenario: Path, gains: str | None, request: Request, out: Path | None, reporter: Reporter
) -> ExitCode:
    """Search better gains for a scenario's plan, verify them by simulation, and write them."""
    load_optimizer()
    weights, limits = read_weights(request.criteria), tuple(map(Limit.parse, request.limits))
    task = read_task(scenario, gains, reporter)
    start = task.scenario.gain_sets[task.scenario.selected_gains]
    parameters = tunable_parameters(start, request.vary)
    folder = ResultFolder.of(task.name, out, "plan", "tuning", below=_TUNED)
    plan = plan_of(task, folder, reporter)
    if plan is None:
        return reporter.code
    runner = TrialRunner(task.scenario, plan, map_cells(task, plan, reporter))
    with reporter.stage("before"):
        before = runner.simulate(start)
    objective = Objective(weights, limits, before.outcome.values)
    found = _search(task, runner, before, parameters, objective, request, reporter)
    if not found.interrupted:
        with reporter.stage("verifying"):
            found.verify(runner.simulate)
    folder.begin("tuning")
    _write_trials(found, folder.path / "trials.json")
    if found.interrupted:  # Drawing would take longer than Ctrl-C may.
        return _interrupted(found, request, folder.path, reporter)
    write_tuning_figure(found, folder.path / "tuning.png")
    return _verified(task, runner, found, request, folder.path, reporter)


def _search(
    task: Task,
    runner: TrialRunner,
    before: GainTrial,
    parameters: tuple[Parameter, ...],
    objective: Objective,
    request: Request,
    reporter: Reporter,
) -> Search:
    """Search in worker processes, and show how far the search has come."""
    allowed = [limit.bound(objective.before) for limit in objective.limits if limit.criterion == "time"]
    longest = _PATIENCE * max([objective.before["time"], *allowed])
    count = min(request.workers or os.cpu_count() or 1, request.runs)
    with (
        reporter.stage("searching", "search") as progress,
        Workers(task.scenario.path, runner.plan, runner.maps, longest=longest, count=count) as workers,
    ):
        return search(
            before,
            parameters,
            objective,
            workers.try_all,
            runs=request.runs,
            seed=request.seed,
            progress=progress,
        )


def _interrupted(found: Search, request: Request, folder: Path, reporter: Reporter) -> ExitCode:
    """Write the best gains so far, and say that they are not verified."""
    _write(
        found, request, folder, reporter, f"Not verified: interrupted after {len(found.trials) - 1} trials."
    )
    _show(reporter, "Best so far", found, found.best.outcome, None)
    reporter.complain("interrupted; the best so far is written")
    return ExitCode.INTERRUPTED


def _verified(
    task: Task, runner: TrialRunner, found: Search, request: Request, folder: Path, reporter: Reporter
) -> ExitCode:
    """Write the best gains, which Drake's loop has run, and simulate a plan that is made anew with them."""
    after = found.best.outcome
    with reporter.stage("planning anew"):
        anew = runner.replan(task.problem, found.best.gains)
    kept = found.objective.kept(after)
    state = (
        "Verified: arrives, keeps all limits." if kept else "Not good: a limit is broken or the run failed."
    )
    _write(found, request, folder, reporter, state)
    _show(reporter, f"{task.name}, gains tuned", found, after, anew)
    if found.best is found.trials[0]:
        reporter.say(
            f"None of {len(found.trials) - 1} runs was better: these are the gains there were before."
        )
    if not kept:
        reporter.complain(f"no gains were found that keep every limit: {after.violation or request.limits}")
    return ExitCode.DONE if kept else ExitCode.FAILED_RUN


def _write(found: Search, request: Request, folder: Path, reporter: Reporter, state: str) -> None:
    remarks = (
        "Gains chosen by coop-drake tune; use them with --gains and this file.",
        f"Better: {', '.join(request.criteria)}; kept: {', '.join(request.limits) or 'no limit'}.",
        f"{len(found.trials) - 1} runs tried, seed {request.seed}. {state}",
    )
    path = _write_gains(found.best.gains, remarks, folder / "gains.yaml")
    reporter.facts["gains_file"] = str(path)
    reporter.say(f"The gain set is in {escape(str(path))}; use it with --gains {escape(str(path))}")


def _write_gains(gains: GainSet, remarks: Sequence[str], path: Path) -> Path:
    """Write a gain set with comments before it, one line each."""
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
