"""Prescribed performance control of the object's angle as a block."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.systems.framework import BasicVector, Context

from coop_drake.control.kernels import track_state, write_walls
from coop_drake.geometry.pose import FloatArray
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of

__all__ = ["OrientationPpc"]


class OrientationPpc(Block):
    """Keeps the object's angle in its funnel: the angular acceleration of (17)-(20).

    ======= ======================== ==== ====================================================== =======
    input   ``object_state``         6    pose and twist of L, angle unwrapped                   W
    input   ``current_cell``         2    index of the current cell, time of its entry [-, s]
    output  ``angle_acceleration``   1    desired angular acceleration [rad/s^2]                 W
    output  ``angle_funnel``         2    lower and upper wall of the funnel now [rad]           W
    ======= ======================== ==== ====================================================== =======

    No state: the funnels depend on the time since the cell was entered.

    Args:
        laws: One law of one axis for each cell of the plan.

    Raises:
        ValueError: There is no law, or a law has not exactly one axis.
    """

    def __init__(self, laws: Sequence[AxisLaw]) -> None:
        super().__init__()
        if not laws or any(law.axes != 1 for law in laws):
            raise ValueError("OrientationPpc needs one law of one axis for each cell")
        self._tables = [law.table for law in laws]
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("angle_acceleration", 1, self._write_acceleration)
        self.DeclareVectorOutputPort(
            "angle_funnel",
            2,
            self._write_funnel,
            {self.time_ticket(), self.input_port_ticket(self._cell.get_index())},
        )

    def _table(self, context: Context) -> tuple[FloatArray, float]:
        cell = self._cell.Eval(context)
        return self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1]

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        table, time = self._table(context)
        track_state(table, time, self._object.Eval(context), 2, 5, output.get_mutable_value())

    def _write_funnel(self, context: Context, output: BasicVector) -> None:
        write_walls(*self._table(context), output.get_mutable_value())
