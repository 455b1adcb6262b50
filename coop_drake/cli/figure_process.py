"""A process that draws the figures of a run: it imports matplotlib while the run is simulated."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from types import TracebackType
from typing import IO, Any

__all__ = ["FigureProcess"]


class FigureProcess:
    """Starts when the block begins, and ends with it.

    The process has a session of its own, so that Ctrl-C reaches only the command, which ends both.
    """

    def __enter__(self) -> FigureProcess:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "coop_drake.cli.figure_process"],
            stdin=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # It finds what this one finds.
            start_new_session=True,
        )
        return self

    def draw(self, *arguments: Any) -> None:
        """Begin to draw.

        Args:
            arguments: Those of `coop_drake.viz.write_figures`.
        """
        with self._input as pipe:
            pickle.dump(arguments, pipe)

    def wait(self) -> None:
        """Wait until all figures are written.

        Raises:
            RuntimeError: They could not be drawn; the process has said why on standard error.
        """
        if code := self._process.wait():
            raise RuntimeError(f"the process that draws the figures ended with code {code}")

    @property
    def _input(self) -> IO[bytes]:
        assert self._process.stdin is not None
        return self._process.stdin

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        if not self._input.closed:
            self._input.close()


def main() -> None:
    """Draw the figures that standard input asks for; nothing where it ends first."""
    from coop_drake.viz.figures import write_figures

    if request := sys.stdin.buffer.read():
        write_figures(*pickle.loads(request))


if __name__ == "__main__":
    main()
