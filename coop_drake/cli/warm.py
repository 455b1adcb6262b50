"""What `doctor --warm` does: compiles every kernel ahead, the planner's and the maps' side by side."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from coop_drake.cli.reporter import Reporter
from coop_drake.cli.task import Task, read_task
from coop_drake.progress import Progress

_SIDE_BY_SIDE = ("coop_drake.planning.warm_up", "coop_drake.harmonic_maps.warm_up")
"""Modules that compile kernels when they are run; they share none."""

_RATE = 200.0
"""Control rate of the team that the compiled loop runs [Hz]; any will do."""

_SIMULATED_SECONDS = 0.05
"""Simulated time after which every kernel of the closed loop has been called [s]."""


def compile_kernels(reporter: Reporter) -> None:
    """Compile all kernels, so that the next command starts at once; `make` does it when it sets up."""
    task = read_task(Path("base"), reporter=reporter)
    with reporter.stage("compiling") as progress:
        _compile(task, progress)


def _compile(task: Task, progress: Progress) -> None:
    from coop_drake.answers import Found
    from coop_drake.compiled_loop import prepare, run
    from coop_drake.planning.planner import plan
    from coop_drake.simulation import build_maps, simulate

    with _started(_SIDE_BY_SIDE) as processes:
        for count, process in enumerate(processes):
            process.wait()
            progress("", (count + 1) / (len(processes) + 1))
    name = task.scenario.selected_gains
    result = plan(task.problem, task.scenario.gain_sets[name], gain_set_name=name)
    if isinstance(result, Found):
        short = replace(task.scenario.simulator, max_time=_SIMULATED_SECONDS)
        brief, maps = replace(task.scenario, simulator=short), build_maps(result.plan)
        simulate(brief, result.plan, maps)
        sampled = replace(brief, deployment=replace(brief.deployment, control_rate=_RATE))
        run(prepare(sampled, result.plan, maps))


@contextmanager
def _started(modules: tuple[str, ...]) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run modules in processes of their own until the block ends; what one does not finish is done later."""
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
