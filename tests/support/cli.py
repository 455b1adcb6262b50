"""The command line, called in this process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from typer.testing import CliRunner

from coop_drake.cli import app

if TYPE_CHECKING:
    from click.testing import Result


def invoke(*arguments: object, **environment: str) -> Result:
    """Call ``coop-drake`` with these arguments as words, and with these environment variables."""
    return CliRunner(env=environment).invoke(app, [str(argument) for argument in arguments])
