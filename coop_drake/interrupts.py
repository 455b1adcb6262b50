"""Starting processes so that Ctrl-C reaches neither them nor the middle of their start; ending them."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

_SIGNALLED = 128
"""What shells add to the number of the signal that ended a command."""


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let Ctrl-C wait until a block is over; processes that are started in it never receive it.

    To block the signal in one thread is not enough. The system hands it to another one, and Python answers it
    in the main thread, maybe between the functions that take and release locks before and after a fork. Such
    a lock would never be released.
    """
    waiting: list[int] = []
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    answers = threading.current_thread() is threading.main_thread()  # Only this thread may set what is done.
    before = signal.signal(signal.SIGINT, lambda number, _: waiting.append(number)) if answers else None
    try:
        yield
    finally:
        if answers:
            signal.signal(signal.SIGINT, before)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        if waiting:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Let the signals with which systems end commands end a block in order, with their usual exit code.

    Without this they end the process at once, and what the block has started or opened is left behind. Only
    the main thread can answer signals; elsewhere this does nothing.
    """

    def end(number: int, frame: FrameType | None) -> NoReturn:
        sys.exit(_SIGNALLED + number)

    answers = threading.current_thread() is threading.main_thread()
    numbers = (signal.SIGTERM, signal.SIGHUP) if answers else ()
    before = {number: signal.signal(number, end) for number in numbers}
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)
