"""What a block remembers of a switch: by how much the accelerations of its axes would jump."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.laws.axis_table import FADING_TIME
from coop_drake.tree.pose import FloatArray


class JumpMemory:
    """Reads a block's discrete group (index of a cell, jumps of m accelerations at the switch to it).

    Args:
        tables: The axes in every cell, each of shape (m, ``LAW_COLUMNS``).
    """

    def __init__(self, tables: Sequence[FloatArray]) -> None:
        self._fading = [float(table[0, FADING_TIME]) for table in tables]
        self._none = np.zeros(len(tables[0]))

    def jumps(self, context: Context, index: int, time: float) -> FloatArray:
        """Return what fades now in a cell, ``time`` [s] after its entry, shape (m,) [rad/s^2 or m/s^2]."""
        if time >= self._fading[index]:  # To read the state in vain would take as long as the law.
            return self._none
        memory = context.get_discrete_state_vector().value()
        return memory[1:] if memory[0] == index else self._none
