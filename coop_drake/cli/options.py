"""Arguments that many commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coop_drake.cli.completion import complete_gains, complete_scenario

__all__ = ["GainsName", "Machine", "PictureFolder", "Quiet", "ResultsFolder", "ScenarioPath"]

ScenarioPath = Annotated[
    Path,
    typer.Argument(
        metavar="SCENARIO",
        help="Scenario file (*.scenario.yaml), a folder with one, or the name of a shipped scenario.",
        autocompletion=complete_scenario,
    ),
]
GainsName = Annotated[
    str | None,
    typer.Option(
        "--gains",
        metavar="NAME|FILE",
        help="Gain set, by name or from a file as `tune` writes it; the scenario's choice by default.",
        autocompletion=complete_gains,
    ),
]
ResultsFolder = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", file_okay=False, help="Where results go; out/<scenario> by default."
    ),
]
PictureFolder = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", file_okay=False, help="Where the picture goes; out/<scenario> by default."
    ),
]
Machine = Annotated[
    bool, typer.Option("--json", help="One JSON object on standard output, all else on standard error.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show errors only.")]
