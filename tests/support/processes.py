"""Processes that tests start, watch and kill."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

T = TypeVar("T")

_PATIENCE = 300.0
"""Longest that a test waits [s]; machines are busy where tests run."""


class Process(NamedTuple):
    """A running process.

    Attributes:
        pid: Its number.
        parent: The number of the process that started it.
        command: Its arguments.
    """

    pid: int
    parent: int
    command: str


def processes(*words: str) -> list[Process]:
    """The running processes whose arguments have all of the words; not those that have ended."""
    lines = subprocess.run(
        ["ps", "-A", "-ww", "-o", "pid=,ppid=,stat=,args="], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    rows = [line.split(maxsplit=3) for line in lines]
    return [
        Process(int(row[0]), int(row[1]), row[3])
        for row in rows
        if len(row) == 4 and not row[2].startswith("Z") and all(word in row[3] for word in words)
    ]


def waited_for(what: Callable[[], T]) -> T:
    """What a function returns as soon as it is true."""
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.02)
    raise AssertionError("nothing came in time")


def kill(pid: int, number: int = signal.SIGKILL) -> None:
    """Send a signal to a process that may have ended."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return
