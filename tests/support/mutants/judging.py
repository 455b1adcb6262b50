"""Holds what the command line answers to a malformed file against what every such answer must be."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import typer

from coop_drake.cli import app
from tests.support.mutants.mutant import Mutant

COMMAND = typer.main.get_command(app)
REMEDY = "; expected "


def faults(
    mutant: Mutant, file: Path, arguments: Sequence[str], out: Path, remedy: str = REMEDY
) -> list[str]:
    """What is wrong with the answer to a mutant; nothing if it is as it should be.

    Args:
        mutant: Its content is written to the file.
        file: Where the command finds it.
        arguments: The command; ``--json`` and ``--out`` are added.
        out: Where results would go; it must not come to be.
        remedy: What stands before the words that help.
    """
    shutil.rmtree(out, ignore_errors=True)
    file.unlink(missing_ok=True)  # Some file systems write a file that is truncated to the disk at once.
    file.write_bytes(mutant.content)
    before = sorted(file.parent.iterdir())
    said, complained = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(complained):
            code = COMMAND.main([*arguments, "--json"], standalone_mode=False)
    except BaseException as error:
        return [f"raised {type(error).__name__}: {str(error)[:200]}"]
    found = [] if code == 2 else [f"exit code {code}"]
    lines = complained.getvalue().splitlines()
    if not lines or not lines[0].startswith("Error: "):
        found.append(f"standard error has {len(lines)} lines: {complained.getvalue()[:300]!r}")
    answers = said.getvalue().splitlines()
    message = json.loads(answers[-1]).get("error", "") if answers else ""
    if len(answers) != 1 or not message:
        found.append(f"standard output is no single JSON object with an error: {said.getvalue()[:200]!r}")
    if file.name not in message:
        found.append("the file is not named")
    if mutant.key not in message:
        found.append(f"the key {mutant.key} is not named")
    if remedy not in message:
        found.append("no remedy")
    if len(message) > 2000:
        found.append(f"the message has {len(message)} characters")
    if not all(file.name in line and remedy in line for line in message.splitlines()):
        found.append("a line of the message does not name the file and a remedy")
    if lines != f"Error: {message}".splitlines():
        found.append("standard error says something else")
    if out.exists() or sorted(file.parent.iterdir()) != before:
        found.append("something was written")
    return [f"{fault} -- {message[:240]}" for fault in found]
