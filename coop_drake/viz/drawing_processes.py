"""Processes that draw a run: its figures and its recording, beside the command.

They import what they need while the command plans and simulates, and prepare what the plan alone shows.
"""

from __future__ import annotations

import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any

from coop_drake.errors import ProcessError, transferable

if TYPE_CHECKING:
    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan import Plan
    from coop_drake.answers.problem import PlanningProblem
    from coop_drake.scenario.model import Scenario
    from coop_drake.viz.figures import RunFigures

_MOST = 2
"""Number of processes that draw figures; more draw no sooner beside the one that makes the recording."""

_LENGTH = 8
"""Bytes of the number that says how long a message is."""


class DrawingProcesses:
    """A process for the figures, which begins with the block, and one for the recording; they end with it.

    They have sessions of their own, so that Ctrl-C reaches only the command, which ends them.
    """

    def __enter__(self) -> DrawingProcesses:
        self._running = {"figures": _started("figures")}
        return self

    def begin(self, scenario: Scenario, problem: PlanningProblem, plan: Plan) -> None:
        """Let the processes prepare what the plan shows.

        Args:
            scenario: The scenario.
            problem: Its planning problem.
            plan: The plan that will be simulated.
        """
        # Now: two processors have enough to do while a plan is searched for.
        self._running["recording"] = _started("recording")
        self._send(scenario, problem.workspace, problem.tree, plan)

    def draw(self, log: SimulationLog, folder: Path) -> None:
        """Begin to draw the run into a folder.

        Args:
            log: The log of the run.
            folder: Receives ``transport.html`` and the figures.
        """
        self._send(log, folder)

    def wait(self) -> None:
        """Wait until all is written.

        Raises:
            ProcessError: A process was ended.
            Exception: Whatever went wrong in a process.
        """
        for subject, process in self._running.items():
            assert process.stdin is not None
            assert process.stdout is not None
            with suppress(BrokenPipeError):
                process.stdin.close()
            error = process.stdout.read()
            code = process.wait()
            if error:
                raise pickle.loads(error)
            if code:
                raise ProcessError(f"the process that draws the {subject} ended with code {code}")

    def _send(self, *message: Any) -> None:
        content = pickle.dumps(message)
        for process in self._running.values():
            assert process.stdin is not None
            with suppress(BrokenPipeError):  # `wait` says why it has ended.
                process.stdin.write(len(content).to_bytes(_LENGTH, "big") + content)
                process.stdin.flush()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._running.values():
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with suppress(BrokenPipeError):
                    pipe.close()  # type: ignore[union-attr]


def _started(subject: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "coop_drake.viz.drawing_processes", subject],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # It finds what this one finds.
        start_new_session=True,
    )


def main(subject: str) -> None:
    """Draw a subject of the run that standard input describes; nothing where it ends before the run does."""
    try:
        draw = {"figures": _draw_figures, "recording": _draw_recording}[subject]
        draw(_Messages(sys.stdin.buffer))
    except Exception as error:
        sys.stdout.buffer.write(pickle.dumps(transferable(error)))
        sys.stdout.flush()
        os._exit(1)
    os._exit(0)  # To take down Drake and matplotlib object by object takes time.


class _Messages:
    """What the command sends: the question with its plan, then the log and the folder."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe

    def next(self) -> Any:
        """Return the next message; end this process where the command ends before it sends one."""
        length = self._pipe.read(_LENGTH)
        # It is read as a whole before anything is imported for it: the sender waits.
        content = self._pipe.read(int.from_bytes(length, "big"))
        if not content:
            os._exit(0)
        return pickle.loads(content)


def _draw_recording(messages: _Messages) -> None:
    scenario, _, _, plan = messages.next()
    from coop_drake.viz.recording import Recording

    recording = Recording(scenario, plan)
    log, folder = messages.next()
    recording.write(log, folder / "transport.html")


def _draw_figures(messages: _Messages) -> None:
    from coop_drake.viz.figures import RunFigures

    _, workspace, tree, plan = messages.next()
    figures = RunFigures(workspace, tree, plan)
    _draw_in_two(figures, *messages.next())


def _draw_in_two(figures: RunFigures, log: SimulationLog, folder: Path) -> None:
    gc.freeze()  # Else each collection of garbage would look at all that was imported.
    waiting, numbers = os.pipe()
    os.write(numbers, bytes(reversed(range(len(figures.names(log))))))  # The summary takes longest.
    os.close(numbers)
    other = os.fork() if (os.cpu_count() or 1) >= _MOST else None
    figures.write(log, folder, numbers=_taken(waiting))
    if other and os.waitpid(other, 0)[1]:
        raise ProcessError("a process that draws figures was ended")


def _taken(waiting: int) -> Iterator[int]:
    """Numbers that no other process has taken from a pipe."""
    while number := os.read(waiting, 1):
        yield number[0]


if __name__ == "__main__":
    main(sys.argv[1])
