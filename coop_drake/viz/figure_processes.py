"""Processes that draw the figures of a run: they import matplotlib while the run is simulated."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from types import TracebackType
from typing import Any

_MOST = 2
"""More processes draw no sooner: each imports matplotlib, which takes as long as four figures."""


class FigureProcesses:
    """Processes that start when the block begins, and end with it.

    They have sessions of their own, so that Ctrl-C reaches only the command, which ends them.
    """

    def __enter__(self) -> FigureProcesses:
        self._processes = [
            subprocess.Popen(
                [sys.executable, "-P", "-m", "coop_drake.viz.figure_processes"],
                stdin=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # They find what this one finds.
                start_new_session=True,
            )
            for _ in range(min(_MOST, os.cpu_count() or 1))
        ]
        return self

    def draw(self, *arguments: Any) -> None:
        """Begin to draw, with the arguments of `coop_drake.viz.write_figures`; each process draws a part."""
        for part, process in enumerate(self._processes):
            assert process.stdin is not None
            with process.stdin as pipe:
                pickle.dump((arguments, {"part": part, "parts": len(self._processes)}), pipe)

    def wait(self) -> None:
        """Wait until all figures are written.

        Raises:
            RuntimeError: They could not be drawn; the process has said why on standard error.
        """
        for process in self._processes:
            if code := process.wait():
                raise RuntimeError(f"a process that draws figures ended with code {code}")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes:
            process.kill()
            process.wait()
            if process.stdin is not None:
                process.stdin.close()


def main() -> None:
    """Draw the figures that standard input asks for; nothing where it ends before it asks."""
    from coop_drake.viz.figures import write_figures

    if request := sys.stdin.buffer.read():
        arguments, options = pickle.loads(request)
        write_figures(*arguments, **options)


if __name__ == "__main__":
    main()
