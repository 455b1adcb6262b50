"""Drawings of a run that are asked for but not made: drawing is slow, and has tests of its own."""

from contextlib import nullcontext
from typing import ClassVar


class NoDrawings(nullcontext):
    """Stands in for ``DrawingProcesses``.

    Attributes:
        asked: Log and folder of every run that was to be drawn since this list was last emptied.
        order: What was waited for in the last run; "none" first if it was to have no figures.
    """

    asked: ClassVar[list[tuple]] = []
    order: ClassVar[list[str]] = []

    def __init__(self, *, figures=True):
        super().__init__()
        self.order[:] = [] if figures else ["none"]

    def __enter__(self):
        return self

    def begin(self, *question):
        pass

    def draw(self, *asked):
        self.asked.append(asked)

    def wait(self, *subjects):
        self.order.extend(subjects)
