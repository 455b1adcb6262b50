"""The two messages of the team: the current cell, sent to every robot, and each robot's ready report."""

from __future__ import annotations

from coop_drake.tree.pose import FloatArray

CURRENT_CELL_SIZE = 2
"""Size of the message of the current cell: its index [-] and the time of its entry [s]."""

READY_SIZE = 2
"""Size of a ready report: the index of the cell that it is about and the margin [-]."""


def index_of(current_cell: FloatArray, cells: int) -> int:
    """Return the index of the current cell.

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
