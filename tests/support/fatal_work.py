"""Work of a campaign in which one piece hangs and another one ends its process."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from coop_drake.campaign.records import RunRecord, Task, Work

WORK = Work("runs", RunRecord, "tests.support.fatal_work:tasks")
HANGS, KILLS, FAILS = 1, 2, 4


def tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield pieces that arrive at once, but for three of them; the last one is in no batch of four."""
    for index in range(order["begin"], order["batch"]["stop"]):
        begun = RunRecord(index, "room", "compiled", index, "{}", arrived=False)
        yield begun, partial(_record, begun)


def _record(begun: RunRecord) -> RunRecord:
    if begun.run == HANGS:
        time.sleep(1000.0)
    if begun.run == KILLS:
        os.kill(os.getpid(), signal.SIGKILL)
    if begun.run == FAILS:
        raise OSError("the disk is full")
    return replace(begun, arrived=True)
