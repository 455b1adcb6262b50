"""Gain advice from a scenario file to a gain set: plan once, search, verify the best, write it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rich.markup import escape

from coop_drake.answers import Found
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.mapping import map_cells
from coop_drake.cli.planning import plan_question, without_plan
from coop_drake.cli.reading import Task, read_task
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.tuning import (
    CRITERIA,
    TUNED,
    Knob,
    Limit,
    Objective,
    Outcome,
    Search,
    Trial,
    Workbench,
    Workers,
    knobs_of,
    read_weights,
    search,
    write_gains,
    write_trials,
)
from coop_drake.viz.tuning_figure import write_tuning_figure

__all__ = ["Wishes", "advise"]

_PATIENCE = 2.0
"""Runs that last so many times longer than before, or than a limit allows, are given up [-]."""


@dataclass(frozen=True)
class Wishes:
    """What the search is asked for, as typed.

    Attributes:
        criteria: NAME or NAME=WEIGHT.
        limits: Such as time<=16.
        vary: Names of gains that may be turned; empty for all.
        budget: Runs to try.
        seed: Seed of the search.
        workers: Processes; None for one a core.
    """

    criteria: tuple[str, ...]
    limits: tuple[str, ...]
    vary: tuple[str, ...]
    budget: int
    seed: int
    workers: int | None


def advise(
    scenario: Path, gains: str | None, wishes: Wishes, out: Path | None, reporter: Reporter
) -> ExitCode:
    """Search better gains for a scenario's plan, verify them, and write them."""
    weights, limits = read_weights(wishes.criteria), tuple(map(Limit.parse, wishes.limits))
    task = read_task(scenario, gains)
    start = task.scenario.gain_sets[task.question.gains]
    knobs = knobs_of(start, wishes.vary)
    folder = ResultFolder(out if out is not None else Path("out") / task.scenario.name / TUNED)
    result = plan_question(task.question, folder, reporter)
    if not isinstance(result, Found):
        return without_plan(task.question, result, folder, reporter)
    bench = Workbench(task.scenario, result.plan, map_cells(task, result.plan, reporter, fresh=False))
    with reporter.stage("before"):
        before = bench.try_gains(start)
    objective = Objective(weights, limits, before.outcome.values)
    found = _search(task, bench, before, knobs, objective, wishes, reporter)
    write_trials(found, folder.path / "trials.json")
    write_tuning_figure(found, folder.path / "tuning.png")
    if found.interrupted:
        return _interrupted(found, wishes, folder.path, reporter)
    return _verified(task, bench, found, wishes, folder.path, reporter)


def _search(
    task: Task,
    bench: Workbench,
    before: Trial,
    knobs: tuple[Knob, ...],
    objective: Objective,
    wishes: Wishes,
    reporter: Reporter,
) -> Search:
    """Search with a bar, in processes of their own."""
    allowed = [limit.bound(objective.before) for limit in objective.limits if limit.criterion == "time"]
    longest = _PATIENCE * max([objective.before["time"], *allowed])
    count = min(wishes.workers or os.cpu_count() or 1, wishes.budget)
    with (
        reporter.stage("searching") as progress,
        reporter.stopwatch("search"),
        Workers(task.scenario.path, bench.plan, bench.maps, longest=longest, count=count) as workers,
    ):
        return search(
            before,
            knobs,
            objective,
            workers.try_all,
            budget=wishes.budget,
            seed=wishes.seed,
            progress=progress,
        )


def _interrupted(found: Search, wishes: Wishes, folder: Path, reporter: Reporter) -> ExitCode:
    """Write the best so far, and say that nobody has verified it."""
    _write(
        found, wishes, folder, reporter, f"Not verified: interrupted after {len(found.trials) - 1} trials."
    )
    _show(reporter, "Best so far", found, found.best.outcome, None)
    reporter.complain("interrupted; the best so far is written")
    return ExitCode.INTERRUPTED


def _verified(
    task: Task, bench: Workbench, found: Search, wishes: Wishes, folder: Path, reporter: Reporter
) -> ExitCode:
    """Carry the whole plan out with the best gains, and the scenario planned anew with them."""
    best = found.best.gains
    with reporter.stage("verifying"):
        after = bench.try_gains(best).outcome
        anew = bench.planned_anew(task.question.problem, best)
    kept = found.objective.kept(after)
    state = (
        "Verified: arrives, keeps all limits." if kept else "Not good: a limit is broken or the run failed."
    )
    _write(found, wishes, folder, reporter, state)
    _show(reporter, f"{task.scenario.name}, gains tuned", found, after, anew)
    if found.best is found.trials[0]:
        reporter.say(
            f"None of {len(found.trials) - 1} runs was better: these are the gains there were before."
        )
    if not kept:
        reporter.complain(f"no gains were found that keep every limit: {after.violation or wishes.limits}")
    return ExitCode.DONE if kept else ExitCode.FAILED_RUN


def _write(found: Search, wishes: Wishes, folder: Path, reporter: Reporter, state: str) -> None:
    remarks = (
        "Gains chosen by coop-drake tune; use them with --gains and this file.",
        f"Better: {', '.join(wishes.criteria)}; kept: {', '.join(wishes.limits) or 'no limit'}.",
        f"{len(found.trials) - 1} runs tried, seed {wishes.seed}. {state}",
    )
    path = write_gains(found.best.gains, remarks, folder / "gains.yaml")
    reporter.facts["gains_file"] = str(path)
    reporter.say(f"The gain set is in {escape(str(path))}; use it with --gains {escape(str(path))}")


def _show(reporter: Reporter, title: str, found: Search, after: Outcome, anew: Outcome | None) -> None:
    """Print every criterion before and after, and note them."""
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
