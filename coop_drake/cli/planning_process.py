"""Planning in a process of its own, while this one imports what simulating needs and reads the models.

In one process the two would take turns: Python's global lock is held while libraries are imported.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from threading import Thread
from typing import IO, TYPE_CHECKING, Any, NoReturn, TypeVar

from coop_drake.cli.kernel_clock import kernel_clock
from coop_drake.errors import ProcessError, transferable
from coop_drake.interrupts import uninterrupted
from coop_drake.kernel_times import KERNEL_TIMES
from coop_drake.progress import Progress

if TYPE_CHECKING:
    from coop_drake.scenario import Scenario

R = TypeVar("R")

_FORKS = sys.platform == "linux"
"""Whether a copy of this process can work: libraries of macOS may not be used in one."""


def beside(work: Callable[[Progress], R], meanwhile: Callable[[], object], progress: Progress) -> R:
    """Do some work in a copy of this process, and something else in this one at the same time.

    Time that the copy spends on kernels counts as that of this process.

    Args:
        work: Called in the copy; what it returns or raises is returned or raised here.
        meanwhile: Called here, in a thread. What goes wrong in it is not reported.
        progress: Called here when the work calls its own argument.

    Raises:
        ProcessError: The copy was ended.
    """
    if not _FORKS:
        return work(progress)
    reading, writing = os.pipe()
    copy = 0
    try:
        with uninterrupted():
            # No other thread of a command holds a lock now, which the copy could wait for without end.
            copy = os.fork()
            if copy == 0:  # Ctrl-C stays blocked here: this process is told, and ends the copy.
                os.close(reading)
                _work(work, writing)
        os.close(writing)
        thread = Thread(target=_quietly, args=(meanwhile,), daemon=True)
        thread.start()
        with os.fdopen(reading, "rb") as messages:
            result: R = _followed(messages, progress)
        thread.join()
        return result
    finally:
        if copy:
            os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)


def prepare_simulation(scenario: Scenario) -> None:
    """Import what simulating needs, and read the models of a scenario, which are kept.

    Args:
        scenario: The one that will be simulated.
    """
    from pydrake.systems.framework import DiagramBuilder

    from coop_drake import fields, simulation
    from coop_drake.plant import build_robot_plant, build_team_plant

    for module, name in ((simulation, "simulate"), (fields, "HarmonicMap")):
        getattr(module, name)
    for robot in build_team_plant(scenario, DiagramBuilder()).robots:
        build_robot_plant(scenario, robot.index)


def _quietly(meanwhile: Callable[[], object]) -> None:
    with suppress(Exception):  # It goes wrong again where it is needed.
        meanwhile()


def _work(work: Callable[[Progress], object], writing: int) -> NoReturn:
    """Do the work, send what comes of it, and end the process."""
    with os.fdopen(writing, "wb") as pipe:

        def send(*message: object) -> None:
            pickle.dump(message, pipe)
            pipe.flush()

        with suppress(BrokenPipeError), kernel_clock(lambda name: send("compiling", name)) as kernels:
            try:
                result = work(lambda *step: send("progress", *step))
                send("result", result, kernels.wall_seconds, kernels.cpu_seconds)
            except Exception as error:
                send("error", transferable(error))
    os._exit(0)


def _followed(messages: IO[bytes], progress: Progress) -> Any:
    """Pass on what the copy says until it sends the result."""
    while True:
        try:
            kind, *content = pickle.load(messages)
        except EOFError:
            raise ProcessError("the process that plans was ended") from None
        if kind == "error":
            raise content[0]
        if kind == "progress":
            progress(*content)
        elif kind == "compiling":
            KERNEL_TIMES.announce(*content)
        else:
            result, wall_seconds, cpu_seconds = content
            KERNEL_TIMES.wall_seconds += wall_seconds
            KERNEL_TIMES.cpu_seconds += cpu_seconds
            return result
