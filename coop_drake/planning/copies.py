"""Work in copies of this process: one that reports on the way, or several independent pieces."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from threading import Thread
from typing import Any, Generic, NoReturn, TypeVar

from coop_drake.errors import ProcessError, transferable
from coop_drake.interrupts import uninterrupted
from coop_drake.kernel_times import KERNEL_TIMES

__all__ = ["FORKS", "Copies", "Copy", "Send"]

R = TypeVar("R")

Send = Callable[..., None]
"""Sends a message to the process that was copied: its kind, and what belongs to it."""

FORKS = sys.platform == "linux"
"""Whether a copy of this process can work: libraries of macOS may not be used in one."""


class Copy:
    """A copy of this process that does some work and ends; it also ends when this process does.

    Its last message is of the kind ``result`` with what the work returned, or ``error`` with what it raised.

    Args:
        work: Called in the copy with what sends further messages. It shall show nothing; what it changes in
            the copy is lost.

    Attributes:
        connection: Where messages come in.
        pid: Number of the process.
    """

    def __init__(self, work: Callable[[Send], object]) -> None:
        self.connection, theirs = Pipe()
        with uninterrupted():
            self.pid = os.fork()
            if self.pid == 0:  # Ctrl-C stays blocked here: the process that was copied is told.
                self.connection.close()
                _work(work, theirs)
        theirs.close()

    def receive(self) -> tuple[Any, ...]:
        """Wait for the next message, and return its kind and what belongs to it.

        Raises:
            ProcessError: The copy was ended.
        """
        try:
            message: tuple[Any, ...] = self.connection.recv()
        except (EOFError, ConnectionError):
            raise ProcessError("the process that plans was ended") from None
        return message

    def end(self) -> None:
        """End the copy, if it has not ended."""
        self.connection.close()
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)


class Copies(Generic[R]):
    """Pieces of work that do not depend on each other, each in a copy of this process.

    The copies start at once; as a context manager they end with the context. Without copies a piece is done
    here when its result is asked for. Results come in the order of the pieces.

    Args:
        works: The pieces. In a copy they shall show nothing; what they change there is lost.
        count: Number of copies at a time; 0 for none, which is also what systems without copies get.
    """

    def __init__(self, works: Sequence[Callable[[], R]], count: int) -> None:
        self._works, self._count = works, count if FORKS else 0
        self._begun = 0
        self._running: dict[Connection, tuple[int, Copy]] = {}
        self._done: dict[int, tuple[Any, ...]] = {}

    def __enter__(self) -> Copies[R]:
        self._begin()
        return self

    def __exit__(self, *_: object) -> None:
        for _index, copy in self._running.values():
            copy.end()
        self._running.clear()

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
            kind, content = self._done.pop(index)
            if kind == "error":
                raise content
            yield content

    def _begin(self) -> None:
        """Start copies until there are enough."""
        while len(self._running) < self._count and self._begun < len(self._works):
            work = self._works[self._begun]
            copy = Copy(lambda send, work=work: work())  # type: ignore[misc]
            self._running[copy.connection] = self._begun, copy
            self._begun += 1

    def _collect(self) -> None:
        """Take the results of copies that are done; wait for one."""
        ready = wait(list(self._running))
        for connection in [one for one in self._running if one in ready]:
            index, copy = self._running.pop(connection)
            try:
                self._done[index] = copy.receive()
            except ProcessError as error:
                self._done[index] = "error", error
            copy.end()


def _work(work: Callable[[Send], object], connection: Connection) -> NoReturn:
    """Do the work, send what comes of it, and end; end before if the other process does."""

    def watch() -> None:
        with suppress(EOFError, OSError):
            connection.recv()
        os._exit(1)

    def send(*message: object) -> None:
        connection.send(message)

    KERNEL_TIMES.compiling = None  # Another thread may have held a lock that showing needs.
    Thread(target=watch, daemon=True).start()
    try:
        try:
            send("result", work(send))
        except Exception as error:
            with suppress(ConnectionError):
                send("error", transferable(error))
    finally:  # Never goes back into what the other process does.
        os._exit(0)
