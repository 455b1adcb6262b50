"""``python -m docs.gallery out/gallery`` runs the transports of the galleries and writes their page."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coop_drake.files import write_atomically
from docs.gallery.cases import FLOORS, TEAMS, Case
from docs.gallery.page import gallery_page
from docs.gallery.stills import BrowserError, browser, take_still

_GALLERIES = {"Six floors": FLOORS, "Six teams": TEAMS}

_COMMAND = (sys.executable, "-c", "from coop_drake.entry_point import main; main()")

_ANSWERS: Sequence[int] = (0, 1, 3, 4)
"""Exit codes of commands that gave an answer."""

_MOMENT = 0.6
"""Part of a transport after which its still is taken: the team is on its way."""


def main(folder: Path) -> int:
    """Write recordings, stills and ``index.md`` into a folder; return the exit code."""
    try:
        browser()  # Before anything is run.
        galleries = {
            heading: [(case, _carried_out(case, folder)) for case in cases]
            for heading, cases in _GALLERIES.items()
        }
    except BrowserError as error:
        print(error, file=sys.stderr)
        return 2
    write_atomically(folder / "index.md", gallery_page(galleries).encode())
    print(f"{folder / 'index.md'} is written; `make docs` shows it")
    return 0


def _carried_out(case: Case, folder: Path) -> dict[str, Any]:
    """Run a case, keep its recording and its still, and return the facts that it printed."""
    print(case.name, flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        work = Path(place)
        scenario = _scenario(case, work)
        facts = _facts("run", scenario, "--no-figures", "--out", str(work / "run"), "--json")
        page, still = folder / f"{case.name}.html", folder / f"{case.name}.png"
        if facts["answer"] == "found":
            shutil.copyfile(work / "run" / "transport.html", page)
            take_still(page, still, _MOMENT * facts["simulated_seconds"])
        else:
            _facts("why", scenario, "--out", str(work / "why"), "--json")
            shutil.copyfile(work / "why" / "why.png", still)
    return facts


def _scenario(case: Case, work: Path) -> str:
    """Return what to run, made if it is not there yet."""
    if case.new is not None:
        _facts("new", case.name, *case.new, "--out", str(work / case.name), "--json")
        return str(work / case.name / f"{case.name}.scenario.yaml")
    return str(case.file) if case.file else case.name


def _facts(*arguments: str) -> dict[str, Any]:
    """Return what a command of coop-drake prints as JSON; a failed run and a proof are answers, too."""
    done = subprocess.run([*_COMMAND, *arguments], check=False, capture_output=True, text=True)
    if done.returncode not in _ANSWERS:
        raise RuntimeError(f"coop-drake {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")
    facts: dict[str, Any] = json.loads(done.stdout)
    return facts


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/gallery")))
