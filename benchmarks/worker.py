"""The other end of ``in_own_process``: ``python -m benchmarks.worker`` reads work and writes its result."""

from __future__ import annotations

import os
import pickle
import resource
import signal
import sys
from math import ceil
from time import process_time
from types import FrameType
from typing import IO

from benchmarks.isolated import GRACE, Isolated
from coop_drake.memory import peak_memory_mb


def main() -> None:
    """Do one piece of work; whatever it prints goes to standard error."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as answer:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        work, arguments, limit = pickle.load(sys.stdin.buffer)
        start = process_time()
        _limit_time(ceil(start + limit), start, answer)
        value = work(*arguments)
        signal.signal(signal.SIGXCPU, signal.SIG_IGN)
        pickle.dump(_cost(value, start), answer)


def _cost(value: object, start: float) -> Isolated[object]:
    return Isolated(value, process_time() - start, peak_memory_mb())


def _limit_time(seconds: int, start: float, answer: IO[bytes]) -> None:
    """Answer and end when the CPU time is used up; the kernel kills what does not get to it.

    Nothing is raised: amid compiled code, or while compiling, an exception would be taken for another one.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)
        pickle.dump(_cost(None, start), answer)
        answer.flush()
        os._exit(0)

    signal.signal(signal.SIGXCPU, stop)
    resource.setrlimit(resource.RLIMIT_CPU, (max(1, seconds), max(1, seconds) + GRACE))


if __name__ == "__main__":
    main()
