"""A process that makes the runs of one batch, or does other work, writes a line for each piece, and ends.

``python -m coop_drake.campaign.running.child ORDER`` with the order as JSON. Drake keeps some memory of every
plant, which ends with the process. Lines on standard output are JSON: ``["begun", record]`` and ``["ended",
record]`` for each piece, ``["alive", null]`` now and then in pieces of other work that take long, ``["costs",
mapping]`` at the end, ``["error", message]`` where none can be made.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import threading
from dataclasses import asdict
from functools import partial
from pkgutil import resolve_name
from time import process_time
from typing import Any

from coop_drake.errors import CoopDrakeError


def main(order: dict[str, Any]) -> int:
    """Make the runs of an order; return the exit code.

    Args:
        order: The fields of `Order`, ``begin`` for the index of the first one to be made, and ``scratch`` for
            a folder of this process alone, which is removed after it.
    """
    tempfile.tempdir = order["scratch"]
    threading.Thread(target=_end_with_supervisor, args=(order["scratch"],), daemon=True).start()
    try:
        _make(order)
    except (CoopDrakeError, OSError) as error:  # A full disk is no fault of the run that met it.
        _say("error", str(error))
        return 1
    return 0


def _make(order: dict[str, Any]) -> None:
    from coop_drake.campaign.batches import work_of
    from coop_drake.campaign.plans import source_digest
    from coop_drake.memory import peak_memory_mb

    sources = source_digest()  # Before runs are made, because somebody may edit the sources meanwhile.
    tasks = resolve_name(work_of(order["batch"]["work"]).tasks)
    for begun, record in tasks(order, partial(_say, "alive", None)):
        _say("begun", asdict(begun))
        _say("ended", asdict(record()))
    _say("costs", {"cpu_seconds": process_time(), "peak_memory_mb": peak_memory_mb(), "sources": sources})


def _say(kind: str, content: object) -> None:
    sys.stdout.write(json.dumps([kind, content]) + "\n")
    sys.stdout.flush()


def _end_with_supervisor(scratch: str) -> None:
    """End this process, and remove its files, when the one that started it has ended, however that was."""
    os.read(sys.stdin.fileno(), 1)  # It returns when no process can write any more.
    shutil.rmtree(scratch, ignore_errors=True)
    os._exit(1)


if __name__ == "__main__":
    sys.exit(main(json.loads(sys.argv[1])))
