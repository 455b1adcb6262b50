"""The two messages of the team: the current cell, told to every robot, and the ready report of each."""

from __future__ import annotations

from coop_drake.tree.pose import FloatArray

__all__ = ["CURRENT_CELL_SIZE", "READY_SIZE", "index_of"]

#: (index, time of entry).
CURRENT_CELL_SIZE = 2
#: (index of the cell that the report is about, margin).
READY_SIZE = 2


def index_of(current_cell: FloatArray, cells: int) -> int:
    """Index of the current cell.

    Args:
        current_cell: Value of a ``current_cell`` port, shape (2,).
        cells: Number of cells of the plan.

    Raises:
        IndexError: The plan has no cell of this index.
    """
    index = int(current_cell[0])
    if 0 <= index < cells:
        return index
    raise IndexError(f"current_cell is {index}; the plan has cells 0 to {cells - 1}")
