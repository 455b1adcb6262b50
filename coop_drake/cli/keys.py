"""The command keys: an address book for a team on several machines, and a private key for each process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import Machine, Quiet, out_folder
from coop_drake.cli.reporter import reporting

_FIRST_PORT = 5600
"""Port on which the world's first channel listens where none is named."""


def keys_command(
    robots: Annotated[int, typer.Option("--robots", metavar="N", help="Number of robots.")] = 2,
    world: Annotated[
        str, typer.Option("--world", metavar="A.B.C.D", help="Address of the machine with the world.")
    ] = "127.0.0.1",
    supervisor: Annotated[
        str | None,
        typer.Option(
            "--supervisor",
            metavar="A.B.C.D",
            help="Address of the machine with the supervisor; that of the world by default.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="P", help="First of three ports that processes listen on.")
    ] = _FIRST_PORT,
    out: Annotated[Path, out_folder("A new folder for the files.")] = Path("keys"),
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Write an address book with public keys, and a private key for each process, for its owner alone."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.errors import ScenarioError
        from coop_drake.messages import make_team_files
        from coop_drake.typed_data import DataError

        try:
            files = make_team_files(out, robots, (world, supervisor or world), port)
        except DataError as error:
            raise ScenarioError("the options", error.key, error.value, error.allowed) from error
        reporter.facts.update(files=[str(path) for path in files])
        reporter.say(f"Written: {', '.join(escape(str(path)) for path in files)}")
        reporter.say(
            f"Next: copy {escape(files[0].name)} to every machine, and each .key to that of its process"
        )
