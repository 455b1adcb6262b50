"""Drawings of a run that are asked for but not made: drawing is slow, and has tests of its own."""

from contextlib import nullcontext
from typing import ClassVar


class NoDrawings(nullcontext):
    """Stands in for ``DrawingProcesses``.

    Attributes:
        asked: Log and folder of every run that was to be drawn since this list was last emptied.
    """

    asked: ClassVar[list[tuple]] = []

    def __enter__(self):
        return self

    def begin(self, *question):
        pass

    def draw(self, *asked):
        self.asked.append(asked)

    def wait(self):
        pass
