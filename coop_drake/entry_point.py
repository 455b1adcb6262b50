"""Begins the command ``coop-drake``, which Ctrl-C ends within two seconds at any moment with code 130."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from time import monotonic
from types import FrameType
from typing import NoReturn

_INTERRUPTED = 130
_PATIENCE = 1.5
"""How long a command may take to end by itself after Ctrl-C [s]: two seconds are promised, and the rest
takes a little."""
_FORWARDED = (signal.SIGTERM, signal.SIGHUP)
"""What else a terminal, a shell or a job scheduler sends to end a command."""


def main() -> None:
    """Run the command line in a copy of this process, which this one ends where the copy does not by itself.

    Libraries of geometry hold Python's global lock, some for minutes, so that no thread of the same process
    could answer Ctrl-C. A shell has Ctrl-C ignored by work behind it: it is then ignored here, too.
    """
    try:
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            _command_line()
            return
        alive, ending = os.pipe()
        copy = os.fork()  # Nothing has been imported that a copy could not use.
        if copy == 0:
            os.close(ending)
            _work(alive)
        _leave(_waited_for(copy))
    except KeyboardInterrupt:
        _leave(None)


def _command_line() -> None:
    from coop_drake.cli import main as command_line

    command_line()


def _work(alive: int) -> NoReturn:
    """Run the command line; end with the process that waits for it, even if that one is killed."""

    def end_with_other() -> None:
        os.read(alive, 1)  # It returns when no process can write any more.
        os._exit(_INTERRUPTED)

    def interrupt(number: int, frame: FrameType | None) -> NoReturn:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # The terminal and the other process may both send it.
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    threading.Thread(target=end_with_other, daemon=True).start()
    code = 0
    try:
        _command_line()
    except KeyboardInterrupt:
        _say_interrupted()
        code = _INTERRUPTED
    sys.stdout.flush()
    os._exit(code)


def _waited_for(copy: int) -> int | None:
    """Wait for the copy and pass signals on; None if it did not end soon after Ctrl-C, and was killed."""
    signals, writer = os.pipe()
    os.set_blocking(writer, False)

    def forward(number: int, frame: FrameType | None) -> None:
        os.kill(copy, number)

    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    for number in (signal.SIGINT, *_FORWARDED):
        signal.signal(number, forward)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    latest: float | None = None
    while True:
        process, status = os.waitpid(copy, os.WNOHANG)
        if process:
            return os.waitstatus_to_exitcode(status)
        if not select.select([signals], [], [], latest and max(latest - monotonic(), 0.0))[0]:
            os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)
            return None
        if signal.SIGINT in os.read(signals, 64):
            latest = latest or monotonic() + _PATIENCE


def _leave(code: int | None) -> NoReturn:
    """End as the copy ended: with its exit code, or by the signal that ended it; None after Ctrl-C."""
    if code is None:
        _say_interrupted()
    elif code < 0:
        if -code != signal.SIGKILL:  # Nobody can have set another action for it.
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(_INTERRUPTED if code is None else code)


def _say_interrupted() -> None:
    """Files are replaced as a whole, so that none is left half written."""
    sys.stderr.write("Error: interrupted; files already written are whole\n")
    sys.stderr.flush()
