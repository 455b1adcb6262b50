"""The user's cache of solved maps, and the command that shows and empties it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.options import Machine
from coop_drake.cli.reporter import Reporter

if TYPE_CHECKING:
    from coop_drake.fields import MapStore

__all__ = ["map_cache", "maps_command"]

_ELSEWHERE = "COOP_DRAKE_CACHE"


def map_cache() -> MapStore:
    """The maps in the folder that the system has for a user's caches, or that ``COOP_DRAKE_CACHE`` names."""
    from platformdirs import user_cache_path

    from coop_drake.fields import MapStore

    elsewhere = os.environ.get(_ELSEWHERE)
    return MapStore((Path(elsewhere) if elsewhere else user_cache_path("coop_drake")) / "maps")


def maps_command(
    clear: Annotated[bool, typer.Option("--clear", help="Forget them all.")] = False,
    machine: Machine = False,
) -> None:
    """Show where solved maps are kept for later runs, or forget them."""
    reporter = Reporter(machine=machine, quiet=False)

    def command() -> ExitCode:
        store = map_cache()
        count, size = len(store.files()), store.size() / 1e6
        if clear:
            store.clear()
        reporter.facts.update(folder=str(store.folder), maps=count, size_mb=round(size, 3), cleared=clear)
        verb = "Forgot" if clear else "There are"
        reporter.say(f"{verb} {count} maps of {size:.1f} MB in {escape(str(store.folder))}")
        return ExitCode.DONE

    run_guarded(reporter, command)
