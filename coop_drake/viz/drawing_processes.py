"""Processes that draw a run beside the command, and the names of what they draw."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, NoReturn

from coop_drake.errors import ProcessError, transferable
from coop_drake.interrupts import uninterrupted

if TYPE_CHECKING:
    from pathlib import Path

    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan import Plan
    from coop_drake.answers.problem import PlanningProblem
    from coop_drake.scenario.model import Scenario

# Names of the figures that depend on the team.

_FIRST, _LAST = 10, 11


def joints_figure_name(robot: int, name: str) -> str:
    """Name of the figure of a robot's joints: Figure 10 for the first, Figure 11 for every other.

    Args:
        robot: Number of the robot, from 0.
        name: Its name.
    """
    return f"fig{min(_FIRST + robot, _LAST)}_joints_{name}"


# Processes that draw a run: its figures and its recording, beside the command.
#
# They import what they need while the command simulates, and prepare the recording of the plan.

_CONTEXT = get_context("fork") if sys.platform == "linux" else get_context("spawn")
"""A copy has imported already what this process has; libraries of macOS may not be used in one."""

_AFTER_RECORDING = 5
"""By how much less urgent figures are than the recording, which people open first [steps of ``nice``]."""
_MOST = 2
"""Number of processes that draw figures; more draw no sooner beside the one that makes the recording."""


class DrawingProcesses:
    """A process for the figures and one for the recording of a plan; both end with the block.

    They have sessions of their own, so that Ctrl-C reaches only the command, which ends them.

    Args:
        figures: Whether figures are drawn beside the recording.
    """

    def __init__(self, *, figures: bool = True) -> None:
        self._figures = figures

    def __enter__(self) -> DrawingProcesses:
        self._running: dict[str, tuple[BaseProcess, Connection]] = {}
        return self

    def begin(self, scenario: Scenario, problem: PlanningProblem, plan: Plan) -> None:
        """Let the processes prepare what the plan shows.

        Args:
            scenario: The scenario.
            problem: Its planning problem.
            plan: The plan that will be simulated.
        """
        # Now: this process has imported Drake, and two processors had enough to do while it planned.
        if self._figures:
            self._start("figures", _draw_figures)
        self._start("recording", _draw_recording)
        self._send((scenario, problem, plan))

    def draw(self, log: SimulationLog, folder: Path) -> None:
        """Begin to draw the run into a folder.

        Args:
            log: The log of the run.
            folder: Receives ``transport.html`` and the figures.
        """
        self._send((log, folder))

    def wait(self, *subjects: Literal["recording", "figures"]) -> None:
        """Wait until all of these that are drawn are written.

        Raises:
            ProcessError: A process was ended.
            Exception: Whatever went wrong in a process.
        """
        for subject in [subject for subject in subjects if subject in self._running]:
            process, connection = self._running[subject]
            error = None
            with suppress(EOFError, ConnectionError):
                error = connection.recv()
            process.join()
            if error is not None:
                raise error
            if code := process.exitcode:
                raise ProcessError(f"the process that draws the {subject} ended with code {code}")

    def _start(self, subject: str, draw: Callable[[Connection], None]) -> None:
        own, other = _CONTEXT.Pipe()
        # A copy holds this process's ends of all pipes, and must close them to see when this process ends.
        ends = [own, *(connection for _, connection in self._running.values())]
        process = _CONTEXT.Process(target=_work, args=(draw, other, ends), daemon=True)
        with uninterrupted():
            process.start()
            self._running[subject] = process, own
        other.close()

    def _send(self, message: object) -> None:
        for _, connection in self._running.values():
            with suppress(ConnectionError):  # `wait` says why it has ended.
                connection.send(message)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process, connection in self._running.values():
            connection.close()
            process.kill()
            with suppress(ProcessLookupError):  # What it has started, too.
                os.killpg(process.pid or 0, signal.SIGKILL)
            process.join()


def _work(draw: Callable[[Connection], None], messages: Connection, ends: Iterable[Connection]) -> NoReturn:
    """Draw in a process of its own, and send back what goes wrong."""
    os.setsid()
    for end in ends:
        end.close()
    try:
        draw(messages)
    except Exception as error:
        messages.send(transferable(error))
        os._exit(1)
    os._exit(0)  # To take down Drake and matplotlib object by object takes time.


def _next(messages: Connection) -> Any:
    """Return the next message; end without a word where the command ends before it sends one."""
    try:
        return messages.recv()
    except EOFError:
        os._exit(0)


def _draw_recording(messages: Connection) -> None:
    from coop_drake.viz.recording import Recording

    scenario, _, plan = _next(messages)
    recording = Recording(scenario, plan)
    log, folder = _next(messages)
    recording.write(log, folder / "transport.html")


def _draw_figures(messages: Connection) -> None:
    from coop_drake.viz.figures import figures_of, write_figures

    _, problem, plan = _next(messages)
    os.nice(_AFTER_RECORDING)
    gc.freeze()  # Else each collection of garbage would look at all that was imported.
    log, folder = _next(messages)
    run = problem, plan, log
    waiting, numbers = os.pipe()
    os.write(numbers, bytes(reversed(range(len(figures_of(*run))))))  # The summary takes longest.
    os.close(numbers)
    other = os.fork() if (os.cpu_count() or 1) >= _MOST else None
    write_figures(*run, folder, numbers=_taken(waiting))
    if other and os.waitpid(other, 0)[1]:
        raise ProcessError("a process that draws figures was ended")


def _taken(waiting: int) -> Iterator[int]:
    """Numbers that no other process has taken from a pipe."""
    while number := os.read(waiting, 1):
        yield number[0]
