"""Compiles every kernel ahead: those of the planner and those of the maps side by side, then what is left."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from coop_drake.answers import Found
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.reading import read_task
from coop_drake.cli.reporter import Reporter
from coop_drake.planning.planner import plan
from coop_drake.simulation import build_maps, simulate

__all__ = ["warm_up"]

_APART = ("coop_drake.planning.warm_up", "coop_drake.fields.warm_up")  # They share no kernel.
_WARM_UP_SECONDS = 0.05  # Simulated time that calls every kernel [s].


def warm_up(scenario: Path, reporter: Reporter) -> ExitCode:
    """Compile all kernels, for later processes too, and go through the chain once without results.

    Raises:
        ScenarioError: The scenario, which is read before anything is compiled, is wrong.
    """
    task = read_task(scenario, None)
    question = task.question
    with reporter.stage("compiling") as progress:
        with _started(_APART) as processes:
            for count, process in enumerate(processes):
                process.wait()
                progress("", (count + 1) / (len(processes) + 1))
        result = plan(question.problem, question.gain_sets[question.gains], gain_set_name=question.gains)
        if isinstance(result, Found):
            short = replace(task.scenario.simulator, max_time=_WARM_UP_SECONDS)
            brief, maps = replace(task.scenario, simulator=short), build_maps(result.plan)
            simulate(brief, result.plan, maps)
            simulate(brief, result.plan, maps, blocks="fused")
    return ExitCode.DONE


@contextmanager
def _started(modules: tuple[str, ...]) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run modules in processes of their own, until the block ends; if one fails, its work is left to us."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # They find what this one finds.
    processes = [
        subprocess.Popen(
            [sys.executable, "-P", "-m", module],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for module in modules
    ]
    try:
        yield processes
    finally:
        for process in processes:
            process.kill()
            process.wait()
