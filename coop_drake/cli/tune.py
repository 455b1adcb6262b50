"""The command tune: chooses gains for a scenario against named criteria."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coop_drake.cli.options import GainsName, Machine, Quiet, ScenarioPath, out_folder
from coop_drake.cli.reporter import reporting

EXAMPLES = (
    ("tune models/base.scenario.yaml", "less force in no more time, into out/base/tuned/gains.yaml"),
    (
        'tune models/base.scenario.yaml --criterion time --limit "peak_force<=1x"',
        "less time with no more force",
    ),
    ("run models/base.scenario.yaml --gains out/base/tuned/gains.yaml", "use them"),
)


def tune_command(
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
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Choose gains: less force, less time or more room, judged by simulating the whole transport.

    The best gain set is written as gains.yaml, which run, plan and simulate take with --gains. Ctrl-C ends
    the search with the best so far.
    """
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.cli.gain_search import Request, tune

        request = Request(
            tuple(criteria or ("peak_force",)),
            tuple(limits if limits is not None else ("time<=1x",)),
            tuple(vary or ()),
            runs,
            seed,
            workers,
        )
        reporter.code = tune(scenario, gains, request, out, reporter)
