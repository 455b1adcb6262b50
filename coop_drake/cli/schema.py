"""The command schema: the JSON Schema of scenario files, for editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import Quiet, out_file
from coop_drake.cli.reporter import reporting


def schema_command(
    out: Annotated[Path | None, out_file("Where to write; standard output by default.")] = None,
    quiet: Quiet = False,
) -> None:
    """Write the JSON Schema of scenario files, so that editors complete and check them."""
    with reporting(quiet=quiet) as reporter:
        from coop_drake.files import write_atomically
        from coop_drake.scenario.json_schema import scenario_schema

        text = json.dumps(scenario_schema(), indent=1) + "\n"
        if out is None:
            typer.echo(text, nl=False)
        else:
            write_atomically(out, text.encode())
            reporter.say(f"The schema is in {escape(str(out))}. Begin scenarios with")
            reporter.say(f"# yaml-language-server: $schema={escape(str(out))}")
