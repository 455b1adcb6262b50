"""Planning in a copy of this process, while this one imports what simulating needs and reads the models.

In one process the two would take turns: Python's global lock is held while libraries are imported.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from coop_drake.compiling import COMPILING, kernel_clock
from coop_drake.errors import ProcessError, transferable
from coop_drake.interrupts import uninterrupted
from coop_drake.progress import Progress

if TYPE_CHECKING:
    from coop_drake.scenario import Scenario

R = TypeVar("R")

Send = Callable[..., None]
"""Sends a message to the process that was copied: its kind, and what belongs to it."""

FORKS = sys.platform == "linux"
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
    if not FORKS:
        return work(progress)

    def told(send: Send) -> tuple[R, float, float]:
        with kernel_clock(lambda name: send("compiling", name)) as kernels:
            result = work(lambda *step: send("progress", *step))
            return result, kernels.wall_seconds, kernels.cpu_seconds

    # No other thread of a command holds a lock now, for which the copy could wait for ever.
    own, theirs = Pipe()
    copy = get_context("fork").Process(target=_work, args=(told, own, theirs))
    with uninterrupted():  # Ctrl-C stays blocked in the copy: this process is told, and ends it.
        copy.start()
    theirs.close()
    try:
        thread = Thread(target=_quietly, args=(meanwhile,), daemon=True)
        thread.start()
        result: R = _followed(own, progress)
        thread.join()
        return result
    finally:
        own.close()
        copy.kill()
        copy.join()


def prepare_simulation(scenario: Scenario) -> None:
    """Import what simulating needs, and read the models of a scenario, which are kept.

    Args:
        scenario: The one that will be simulated.
    """
    from pydrake.systems.framework import DiagramBuilder

    from coop_drake import harmonic_maps, simulation
    from coop_drake.plant import build_robot_plant, build_team_plant

    for module, name in ((simulation, "simulate"), (harmonic_maps, "HarmonicMap")):
        getattr(module, name)
    for robot in build_team_plant(scenario, DiagramBuilder()).robots:
        build_robot_plant(scenario, robot.index)


def _quietly(meanwhile: Callable[[], object]) -> None:
    with suppress(Exception):  # It goes wrong again where it is needed.
        meanwhile()


def _followed(connection: Connection, progress: Progress) -> Any:
    """Pass on what the copy says until it sends the result.

    Raises:
        ProcessError: The copy was ended.
    """
    while True:
        try:
            kind, *content = connection.recv()
        except (EOFError, ConnectionError):
            raise ProcessError("the process that plans was ended") from None
        if kind == "error":
            raise content[0]
        if kind == "progress":
            progress(*content)
        elif kind == "compiling":
            COMPILING.announce(*content)
        else:
            ((result, wall_seconds, cpu_seconds),) = content
            COMPILING.wall_seconds += wall_seconds
            COMPILING.cpu_seconds += cpu_seconds
            return result


def _work(work: Callable[[Send], object], parents: Connection, connection: Connection) -> NoReturn:
    """Do the work, send what comes of it, and end; end before if the other process does."""
    parents.close()

    def watch() -> None:
        with suppress(EOFError, OSError):
            connection.recv()
        os._exit(1)

    def send(*message: object) -> None:
        connection.send(message)

    COMPILING.tell = None  # Another thread may have held a lock that showing needs.
    Thread(target=watch, daemon=True).start()
    try:
        try:
            send("result", work(send))
        except Exception as error:
            with suppress(ConnectionError):
                send("error", transferable(error))
    finally:  # Never goes back into what the other process does.
        os._exit(0)
