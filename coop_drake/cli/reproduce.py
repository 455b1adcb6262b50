"""The command reproduce: plays what the paper reports and sets the figures beside each other."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.reporter import Reporter

if TYPE_CHECKING:
    from coop_drake.reproduction import GainFigures

__all__ = ["reproduce_command"]

_ROWS = (
    ("duration", "seconds", "{:.1f} s"),
    ("peak base force", "peak_force", "{:.0f} N"),
    ("peak angular acceleration", "peak_angular_acceleration", "{:.1f} rad/s²"),
    ("peak joint rate", "peak_joint_rate", "{:.2f} rad/s"),
    ("smallest funnel margin", "funnel_margin", "{:.4f} rad"),
    ("largest acceleration error", "acceleration_error", "{:.1e} m/s²"),
)


def reproduce_command(
    scenario: Annotated[
        Path,
        typer.Argument(
            metavar="SCENARIO", help="A scenario with the paper's team, such as models/base.scenario.yaml."
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", file_okay=False, help="Where the figures go.")
    ] = Path("out/reproduction"),
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show errors only.")] = False,
) -> None:
    """Play the thirty cells of the paper's Table 1, with its gains and with the scheduled ones."""
    reporter = Reporter(machine=False, quiet=quiet)
    run_guarded(reporter, lambda: _reproduce(scenario, out, reporter))


def _reproduce(scenario: Path, out: Path, reporter: Reporter) -> ExitCode:
    # Here and not above: no other command should wait for Drake.
    from coop_drake.files import write_atomically
    from coop_drake.reproduction import compare_gains
    from coop_drake.scenario import load_scenario

    task = load_scenario(scenario)
    with reporter.stage("simulating") as progress:
        figures = compare_gains(task, progress=progress)
    for gains in figures:
        reporter.table(f"Table 1 with {gains.name}", _rows(gains))
    path = out / "table_1_gains.json"
    out.mkdir(parents=True, exist_ok=True)
    write_atomically(path, json.dumps([asdict(gains) for gains in figures], indent=1).encode() + b"\n")
    reporter.say(f"The figures are in {escape(str(path))}")
    broken = [gains for gains in figures if gains.violation]
    for gains in broken:
        reporter.complain(f"{gains.name}: {gains.violation}")
    return ExitCode.FAILED_RUN if broken else ExitCode.DONE


def _rows(gains: GainFigures) -> list[tuple[str, str]]:
    return [(label, form.format(getattr(gains, name))) for label, name, form in _ROWS]
