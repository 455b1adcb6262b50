"""A process that begins as a new interpreter, with the interface of those of ``multiprocessing``.

A copy of a process that simulates would have its sockets, too. What ``multiprocessing`` starts anew imports
the main module of the program again, which for a script without a guard would run the script again.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

_BEGIN = "import pickle, sys; work, arguments = pickle.load(sys.stdin.buffer); work(*arguments)"


class FreshProcess:
    """Calls a function in a new interpreter.

    Args:
        work: The function; it and its arguments are pickled.
        arguments: Its arguments.
    """

    def __init__(self, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        path = os.pathsep.join(folder for folder in sys.path if folder)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _BEGIN], stdin=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path}
        )
        assert self._process.stdin is not None
        with self._process.stdin as pipe:
            pickle.dump((work, arguments), pipe)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def exitcode(self) -> int | None:
        """Its exit code, None while it runs."""
        return self._process.poll()

    def is_alive(self) -> bool:
        """Whether it runs."""
        return self.exitcode is None

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end, at most for a time [s]."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout)
