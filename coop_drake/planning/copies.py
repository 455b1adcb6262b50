"""Independent pieces of work in copies of this process; their results come in the order of the pieces."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from threading import Thread
from typing import Generic, NoReturn, TypeVar, cast

from coop_drake.errors import ProcessError, transferable
from coop_drake.interrupts import uninterrupted
from coop_drake.kernel_times import KERNEL_TIMES

__all__ = ["Copies"]

R = TypeVar("R")

_FORKS = sys.platform == "linux"
"""Whether a copy of this process can work: libraries of macOS may not be used in one."""


class Copies(Generic[R]):
    """Pieces of work that do not depend on each other, each in a copy of this process.

    The copies start at once; as a context manager they end with the context. Without copies a piece is done
    here when its result is asked for. Results come in the order of the pieces.

    Args:
        works: The pieces. In a copy they shall show nothing; what they change there is lost.
        count: Number of copies at a time; 0 for none, which is also what systems without copies get.
    """

    def __init__(self, works: Sequence[Callable[[], R]], count: int) -> None:
        self._works, self._count = works, count if _FORKS else 0
        self._begun = 0
        self._alive: tuple[int, int] | None = None
        self._running: dict[Connection, tuple[int, int]] = {}
        self._done: dict[int, tuple[R, Exception | None]] = {}

    def __enter__(self) -> Copies[R]:
        if self._count:
            self._alive = os.pipe()
            self._begin()
        return self

    def __exit__(self, *_: object) -> None:
        for connection, (_index, copy) in self._running.items():
            connection.close()
            with suppress(ProcessLookupError):
                os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)
        self._running.clear()
        for end in self._alive or ():
            os.close(end)

    def __iter__(self) -> Iterator[R]:
        """Yield the results in the order of the pieces.

        Raises:
            ProcessError: A copy was ended.
            Exception: Whatever went wrong in the piece whose turn it is.
        """
        for index, work in enumerate(self._works):
            if not self._count:
                yield work()
                continue
            while index not in self._done:
                self._collect()
                self._begin()
            result, error = self._done.pop(index)
            if error is not None:
                raise error
            yield result

    def _begin(self) -> None:
        """Start copies until there are enough."""
        while len(self._running) < self._count and self._begun < len(self._works):
            reading, writing = Pipe(duplex=False)
            with uninterrupted():
                copy = os.fork()
                if copy == 0:  # Ctrl-C stays blocked here: the process that was copied is told.
                    assert self._alive is not None
                    os.close(self._alive[1])
                    _work(self._works[self._begun], writing, self._alive[0])
            writing.close()
            self._running[reading] = self._begun, copy
            self._begun += 1

    def _collect(self) -> None:
        """Take the results of copies that are done; wait for one."""
        ready = wait(list(self._running))
        for connection in [one for one in self._running if one in ready]:
            index, copy = self._running.pop(connection)
            try:
                self._done[index] = connection.recv()
            except EOFError:
                self._done[index] = cast(R, None), ProcessError("a process that planned was ended")
            connection.close()
            os.waitpid(copy, 0)


def _work(work: Callable[[], object], writing: Connection, alive: int) -> NoReturn:
    """Do a piece of work, send what comes of it, and end; end before if the other process does."""

    def watch() -> None:
        os.read(alive, 1)
        os._exit(1)

    KERNEL_TIMES.compiling = None  # Another thread may have held a lock that showing needs.
    Thread(target=watch, daemon=True).start()
    result: object = None
    failure: Exception | None = None
    try:
        try:
            result = work()
        except Exception as error:
            failure = transferable(error)
        with suppress(BrokenPipeError):
            writing.send((result, failure))
    finally:  # Never goes back into what the other process does.
        os._exit(0)
