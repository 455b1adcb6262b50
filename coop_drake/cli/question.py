"""What a command asks the planner, read by a process of its own that gives Drake's memory back."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coop_drake.answers import PlanningProblem
    from coop_drake.laws import GainSet

__all__ = ["Question", "read_apart"]


@dataclass(frozen=True)
class Question:
    """What is to be planned, with nothing of Drake in it.

    Attributes:
        name: The scenario's name.
        path: The scenario file.
        problem: What the planner is asked.
        gain_sets: The scenario's gain sets by name.
        gains: Name of the one in use.
    """

    name: str
    path: Path
    problem: PlanningProblem
    gain_sets: Mapping[str, GainSet]
    gains: str


def read_apart(
    path: Path, gains: str | None = None, meanwhile: Callable[[], object] | None = None
) -> Question:
    """Read a scenario and its models in a process of their own.

    Only reading takes Drake. What planning does not need would stay in memory for as long as it lasts; where
    Drake is in memory already, nothing is to be had from another process.

    Args:
        path: The scenario file.
        gains: Name of the gain set to use, or a file that holds one; None for the one the scenario selects.
        meanwhile: What this process can do while the other one reads.

    Raises:
        ScenarioError: The file, a model or the gain set is wrong.
    """
    if "pydrake" in sys.modules:
        from coop_drake.cli.reading import read_task

        return read_task(path, gains).question
    with subprocess.Popen(
        [sys.executable, "-P", "-m", "coop_drake.cli.reading"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # It finds what this one finds.
        start_new_session=True,  # Ctrl-C is answered here.
    ) as process:
        try:
            stdin, stdout = process.stdin, process.stdout
            assert stdin is not None
            assert stdout is not None
            with suppress(BrokenPipeError), stdin:  # Why it has ended its code says.
                stdin.write(pickle.dumps((path, gains)))
            if meanwhile is not None:
                meanwhile()
            answer = stdout.read()
            process.wait()
        finally:
            process.kill()
    if process.returncode != 0:
        raise RuntimeError(f"{path}: the process that reads it ended with code {process.returncode}")
    came: Question | Exception = pickle.loads(answer)
    if isinstance(came, Exception):
        raise came
    return came
