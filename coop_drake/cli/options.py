"""Arguments that many commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coop_drake.cli.completion import complete_gains, complete_scenario

__all__ = ["GainsName", "ScenarioPath"]

ScenarioPath = Annotated[
    Path,
    typer.Argument(
        metavar="SCENARIO",
        help="Scenario file (*.scenario.yaml), or the name of a shipped scenario.",
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
