"""What `doctor --warm` does: compiles every kernel ahead, in two processes side by side."""

from __future__ import annotations

import os
import subprocess
import sys

from coop_drake.cli.reporter import Reporter

_PROCESSES = (
    ("coop_drake.planning.warm_up",),
    ("coop_drake.harmonic_maps.warm_up", "coop_drake.compiled_loop.warm_up"),
)
"""Modules that compile kernels, those of a process one after the other; both processes take about as long."""


def compile_kernels(reporter: Reporter) -> None:
    """Compile all kernels, so that the next command starts at once; `make` does it when it sets up."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # They find what this one finds.
    programs = ["".join(f"import {one} as part; part.main()\n" for one in modules) for modules in _PROCESSES]
    processes = [
        subprocess.Popen(
            [sys.executable, "-P", "-c", program],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for program in programs
    ]
    with reporter.stage("compiling") as progress:
        try:
            for count, process in enumerate(processes):
                process.wait()
                progress("", (count + 1) / len(processes))
        finally:
            for process in processes:
                process.kill()
                process.wait()
