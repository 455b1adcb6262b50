"""Figures of a run that are asked for but not drawn: drawing is slow, and has tests of its own."""

from contextlib import nullcontext
from typing import ClassVar


class NoFigures(nullcontext):
    """Stands in for ``FigureProcesses``.

    Attributes:
        asked: The arguments of every figure that was asked for since this list was last emptied.
    """

    asked: ClassVar[list[tuple]] = []

    def __enter__(self):
        return self

    def draw(self, *asked):
        self.asked.append(asked)

    def wait(self):
        pass
