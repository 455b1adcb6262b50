"""A process that draws the figures of a run: it imports matplotlib while the run is planned and simulated."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterator
from contextlib import suppress
from types import TracebackType
from typing import Any

_MOST = 2
"""Number of processes that draw; more draw no sooner beside the one that writes the recording."""


class FigureProcesses:
    """A process that starts when the block begins and ends with it; it draws in two processes.

    It has a session of its own, so that Ctrl-C reaches only the command, which ends it.
    """

    def __enter__(self) -> FigureProcesses:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "coop_drake.viz.figure_processes"],
            stdin=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # It finds what this one finds.
            start_new_session=True,
        )
        return self

    def draw(self, *arguments: Any) -> None:
        """Begin to draw.

        Args:
            arguments: Those of `coop_drake.viz.write_figures`.
        """
        assert self._process.stdin is not None
        with self._process.stdin as pipe:
            pickle.dump(arguments, pipe)

    def wait(self) -> None:
        """Wait until all figures are written.

        Raises:
            RuntimeError: They could not be drawn; the process has said why on standard error.
        """
        if code := self._process.wait():
            raise RuntimeError(f"a process that draws figures ended with code {code}")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()


def main() -> None:
    """Draw the figures that standard input asks for; nothing where it ends before it asks."""
    from coop_drake.viz.figures import figure_names, write_figures

    request = sys.stdin.buffer.read()
    if not request:
        return
    arguments = pickle.loads(request)
    waiting, numbers = os.pipe()
    os.write(
        numbers, bytes(reversed(range(len(figure_names(*arguments[:-1])))))
    )  # The summary takes longest.
    os.close(numbers)
    other = os.fork() if (os.cpu_count() or 1) >= _MOST else None
    failed = False
    try:
        write_figures(*arguments, numbers=_taken(waiting))
    except Exception:
        traceback.print_exc()
        failed = True
    if other:
        failed |= os.waitpid(other, 0)[1] != 0
    sys.stderr.flush()
    os._exit(int(failed))


def _taken(waiting: int) -> Iterator[int]:
    """Numbers that no other process has taken from a pipe."""
    while number := os.read(waiting, 1):
        yield number[0]


if __name__ == "__main__":
    main()
