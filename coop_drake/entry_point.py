"""Begins the command ``coop-drake``, so that Ctrl-C ends it soon at any moment, with exit code 130."""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType

_INTERRUPTED = 130
_PATIENCE = 1.5
"""How long Python may take to notice Ctrl-C [s]: it does so only when compiled code returns. Two seconds are
promised, and the end itself takes a little."""


def main() -> None:
    """Run the command line."""
    try:
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as a shell has it for work behind it
            _end_soon_after_interrupt()
        from coop_drake.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        _leave()


def _end_soon_after_interrupt() -> None:
    """Raise `KeyboardInterrupt` at Ctrl-C; end the process where compiled code keeps Python from it."""
    noticed = threading.Event()
    reader, writer = os.pipe()
    os.set_blocking(writer, False)

    def notice(number: int, frame: FrameType | None) -> None:
        noticed.set()
        signal.default_int_handler(number, frame)

    def watch() -> None:
        while os.read(reader, 1) != bytes([signal.SIGINT]):
            pass
        if not noticed.wait(_PATIENCE):
            _leave()

    signal.signal(signal.SIGINT, notice)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=watch, daemon=True).start()


def _leave() -> None:
    """End at once: files are replaced as a whole, so that none is left half written."""
    sys.stderr.write("Error: interrupted; files already written are whole\n")
    sys.stderr.flush()
    os._exit(_INTERRUPTED)
