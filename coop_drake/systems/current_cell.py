"""The two messages of the team: the current cell, told to every robot, and the ready report of each."""

from __future__ import annotations

from typing import NamedTuple

from coop_drake.geometry.pose import FloatArray

__all__ = ["CURRENT_CELL_SIZE", "READY_SIZE", "CurrentCell", "read_current_cell"]

#: (index, time of entry).
CURRENT_CELL_SIZE = 2
#: (index of the cell that the report is about, margin).
READY_SIZE = 2


class CurrentCell(NamedTuple):
    """Index of the current cell and the time at which it was entered [s]."""

    index: int
    start: float


def read_current_cell(value: FloatArray, cells: int) -> CurrentCell:
    """Read a ``current_cell`` port.

    Args:
        value: (index, start), shape (2,) [-, s].
        cells: Number of cells of the plan.

    Raises:
        IndexError: The plan has no cell of this index.
    """
    index = int(value[0])
    if not 0 <= index < cells:
        raise IndexError(f"current_cell is {index}; the plan has cells 0 to {cells - 1}")
    return CurrentCell(index, float(value[1]))
